"""Formulas whose truth spreads: pure eventualities towards earlier letters, purely universal ones towards later."""

from __future__ import annotations

from llfsm_verify.logic.formula import Formula, postorder


class Purity:
    """Answers for formulas in negation normal form, remembered.

    An *eventual* formula holds at a position when it holds at a later one; a *universal* one holds at all later
    positions when it holds at one. Formulas that are both do not depend on the position. Only the form is looked at:
    yes is always right. Source: Etessami and Holzmann, Optimizing Büchi automata, CONCUR 2000.
    """

    def __init__(self) -> None:
        self._known: dict[Formula, tuple[bool, bool, bool]] = {}

    def is_eventual(self, f: Formula) -> bool:
        """True at a position when it is true at a later one."""
        return self._of(f)[0]

    def is_universal(self, f: Formula) -> bool:
        """True at all later positions when it is true at one."""
        return self._of(f)[1]

    def is_suspendable(self, f: Formula) -> bool:
        """Eventual and universal: `G F p`, and the like."""
        eventual, universal, _ = self._of(f)
        return eventual and universal

    def is_boolean(self, f: Formula) -> bool:
        """There is no temporal operator."""
        return self._of(f)[2]

    def _of(self, f: Formula) -> tuple[bool, bool, bool]:
        known = self._known.get(f)
        if known is None:
            for node in postorder(f, known=self._known):
                self._known[node] = self._computed(node)
            known = self._known[f]
        return known

    def _computed(self, f: Formula) -> tuple[bool, bool, bool]:
        args = [self._known[a] for a in f.args]
        eventual = all(a[0] for a in args)
        universal = all(a[1] for a in args)
        boolean = all(a[2] for a in args)
        match f.op:
            case "true" | "false":
                return True, True, True
            case "atom" | "not":
                return False, False, True
            case "and" | "or":
                return eventual, universal, boolean
            case "X":
                return eventual, universal, False
            case "F":
                return True, universal, False
            case "G":
                return eventual, True, False
            case "U" | "R":
                return args[1][0], args[1][1], False
            case "W":
                return eventual, args[1][1], False
            case "M":
                return args[1][0], universal, False
        raise ValueError(f"not in negation normal form: {f.op}")
