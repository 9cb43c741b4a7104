"""Hypothesis strategies for your own tests; they need the extra `test`, and are imported from their modules.

- `llfsm_verify.testing.arrangements.arrangements()`: documents of whole arrangements, for `build_arrangement`
- `llfsm_verify.testing.properties.properties(arrangement)`: LTL texts about an arrangement; `atoms(arrangement)`
- `llfsm_verify.testing.formulas`: `formulas()`, `letters()`, `lassos()`
- `llfsm_verify.testing.programs.programs()`: step programs, for those who write an engine
"""
