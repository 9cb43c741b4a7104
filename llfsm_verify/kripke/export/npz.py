"""Kripke structures as NumPy arrays in one `.npz` file."""

from __future__ import annotations

import json
from io import BytesIO

from llfsm_verify.kripke.structure import Structure


def npz(structure: Structure) -> bytes:
    """The file: the arrays of `Structure`, and `fields`, which tells where each variable lies in the words of `keys`.

    Nothing in it is pickled. docs/kripke.md describes every array.
    """
    import numpy as np

    variables = [v for v in structure.program.vars if not v.output]
    places = [structure.layout.fields[v.name] for v in variables]
    numbers = [[f.word, f.shift, f.bits, f.low, -1 if f.length is None else f.length, f.per_word] for f in places]
    about = {
        "arrangement": structure.name,
        "complete": structure.complete,
        "stopped": structure.stopped,
        "expanded": structure.expanded,
        "labels": {v.name: v.origin.labels for v in variables if v.origin.labels},
        "atoms": len(structure.atoms),
    }
    file = BytesIO()
    np.savez_compressed(
        file,
        indptr=structure.indptr,
        targets=structure.targets,
        labels=structure.labels,
        alphabet=structure.alphabet,
        propositions=np.array(structure.propositions, dtype=np.str_),
        roots=structure.roots,
        first=structure.first,
        keys=structure.keys,
        variables=np.array([v.name for v in variables], dtype=np.str_),
        fields=np.array(numbers, dtype=np.int64).reshape(len(variables), 6),
        about=np.array(json.dumps(about)),
    )
    return file.getvalue()
