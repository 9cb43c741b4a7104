% Loads a program and answers the queries of bridge.py, one after the other, each with facts and a database of its own.
% A reply is a line: its kind, a line and a column (0: unknown), a file and a text (as the codes of their characters).
:- module(llfsm_worker, [serve/2]).
:- use_module(library(time)).
:- use_module(library(prolog_stack)).
:- use_module(library(prolog_codewalk)).
:- dynamic loading/1, serving/1.
:- multifile user:message_hook/3.

serve(In, Out) :-
    set_stream(In, record_position(false)),
    asserta(serving(Out)),
    at_halt(halted),
    repeat,
    catch(read_term(In, Asked, []), E, Asked = unreadable(E)),
    serve(Asked, In, Out),
    !.

serve(end_of_file, _, _) :- retractall(serving(_)).
serve(load(File, Facts, Goals), _, Out) :-
    asserta(loading(Out), Ref),
    forall(nth0(N, Facts, F), (functor(F, Name, A), catch(dynamic(user:Name/A), E, unusable(Out, fact, N, E)))),
    catch(load_files(user:File, []), E, print_message(error, E)),
    forall((member(F, Facts), catch(clause(user:F, _, C), _, fail)), (place(C, P), reply(Out, clause, P, F))),
    forall((nth0(N, Goals, G), \+ predicate_property(user:G, visible)),
           (functor(G, Name, A), unusable(Out, query, N, error(existence_error(procedure, Name/A), _)))),
    prolog_walk_code([undefined(trace), on_trace(undefined(Out)), module_class([user])]),
    erase(Ref),
    reply(Out, loaded, ''-0-0, ''),
    fail.
serve(ask(Facts, Goal, Value, Limit), _, Out) :-
    abolish_all_tables,
    catch(call_with_time_limit(Limit, snapshot(prove(Facts, Goal, Value, Kind, Place, Text))), E,
          failed(E, Kind, Place, Text)),
    flush_output(user_output),
    flush_output(user_error),
    reply(Out, Kind, Place, Text),
    fail.
serve(unreadable(E), _, Out) :-
    failed(E, Kind, Place, Text),
    reply(Out, Kind, Place, Text),
    fail.

prove(Facts, Goal, Value, Kind, Place, Text) :-
    forall(member(F, Facts), assertz(user:F)),
    catch_with_backtrace(
        (   user:Goal
        ->  Place = ''-0-0, kind(Value, Kind), with_output_to(string(Text), write_term(Value, [max_depth(9)]))
        ;   Kind = none, Place = ''-0-0, Text = ''
        ), E, failed(E, Kind, Place, Text)).

kind(Value, number) :- number(Value), \+ (rational(Value), \+ integer(Value)), !.
kind(Value, name) :- atom(Value), !.
kind(Value, name) :- string(Value), !.
kind(_, other).

halted :-
    serving(Out),
    get_prolog_backtrace(50, Stack),
    ( source_location(File, Line) -> Place = File-Line-0 ; own_place(Stack, Place) ),
    reply(Out, halt, Place, '').

failed(time_limit_exceeded, limit, ''-0-0, '') :- !.
failed(error(Formal, context(prolog_stack(Stack), More)), error, Place, Text) :-
    !,
    own_place(Stack, Place),
    told(error(Formal, context(_, More)), Text).
failed(E, error, ''-0-0, Text) :- ( E = error(_, _) -> told(E, Text) ; format(string(Text), 'uncaught exception ~p', [E]) ).

own_place(Stack, File-Line-0) :-
    current_prolog_flag(home, Home),
    member(frame(_, pred_line(_, File:Line), _), Stack),
    \+ module_property(llfsm_worker, file(File)),
    \+ sub_atom(File, 0, _, _, Home),
    !.
own_place(_, ''-0-0).

told(E, Text) :-
    phrase('$messages':translate_message(E), Lines),
    with_output_to(string(Text), print_message_lines(current_output, '', Lines)).

user:message_hook(Message, Kind, _) :-
    memberchk(Kind, [error, warning]),
    loading(Out),
    (   Message = error(syntax_error(E), file(File, Line, Before, _))
    ->  told(error(syntax_error(E), _), Text), Column is Before + 1, Place = File-Line-Column
    ;   told(Message, Text), (source_location(File, Line) -> Place = File-Line-0 ; Place = ''-0-0)
    ),
    reply(Out, Kind, Place, Text).

undefined(Out, Callee, _, Location) :-
    ( Location = clause_term_position(C, At) -> arg(1, At, From) ; Location = clause(C) ),
    (   nonvar(From)
    ->  clause_property(C, file(File)), read_file_to_string(File, All, []), sub_string(All, 0, From, _, Before),
        split_string(Before, "\n", "", Lines), length(Lines, Line), last(Lines, Last), string_length(Last, Length),
        Column is Length + 1, Place = File-Line-Column
    ;   place(C, Place)
    ),
    strip_module(Callee, _, Goal),
    functor(Goal, Name, Arity),
    reply(Out, undefined, Place, Name/Arity).

place(C, File-Line-0) :- clause_property(C, file(File)), clause_property(C, line_count(Line)), !.
place(_, ''-0-0).

unusable(Out, Kind, N, E) :- told(E, Text), reply(Out, Kind, ''-N-0, Text).

reply(Out, Kind, File-Line-Column, Text) :-
    codes(File, F),
    codes(Text, T),
    format(Out, '~w ~w ~w ~w ~w~n', [Kind, Line, Column, F, T]),
    flush_output(Out).

codes(Text, Shown) :-
    format(string(S), '~w', [Text]),
    sub_string(S, 0, L, _, Start), ( L =:= 300 ; string_length(S, L) ), !,
    string_codes(Start, Codes),
    atomic_list_concat([0|Codes], ',', Shown).
