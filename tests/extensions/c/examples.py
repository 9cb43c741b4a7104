"""Commands that make the program say what is wrong with an arrangement as C, or with an image."""

from __future__ import annotations

from tests.outputs.provoking import BUILD, LAMP, Provoked, does

AVR = BUILD.replace("none", "avr")
OF_ANOTHER = '{"vectors": 1, "program": "", "unit": "cycle", "inputs": [], "fields": [], "sequences": []}'
PROVOKED = {
    "E504": Provoked(
        (BUILD,),
        does(
            "x = k[0];",
            "k_0: {type: bool, role: input}, k: {type: {array: bool, size: 2}, role: input}, x: {type: bool}",
        ),
    ),
    "E508": Provoked((f"{BUILD} --verify --cc no-such-compiler",), LAMP),
    "E509": Provoked((f"{BUILD} --verify --vectors v.json",), LAMP | {"v.json": OF_ANOTHER}),
    "E517": Provoked((f"{BUILD} -p 'x: G (n + 1 > 3)'",), does("n = 1;", "n: {type: int}")),
    "E525": Provoked((BUILD,), {"a.yaml": "name: signal\n" + LAMP["a.yaml"]}),
    "E506": Provoked((f"{AVR} --pins pins.yaml",), LAMP | {"pins.yaml": "pins: {go: PB9}\n"}),
    "E507": Provoked((f"{AVR} --clock-hz 4000",), LAMP),
}
