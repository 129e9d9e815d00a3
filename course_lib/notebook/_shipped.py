"""What a cell showed when its notebook was built, for a machine on which its real data are not."""

from __future__ import annotations

import json
from base64 import b64decode
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("notebooks", "exercises")  # of solutions a learner sees nothing


def stored_outputs(source: str) -> list[dict]:
    """The outputs that a shipped notebook stores of a cell with exactly this text; none where there is no such cell."""
    source = source.strip("\n")
    first = json.dumps(source.partition("\n")[0])[1:-1]
    for path in (path for folder in FOLDERS for path in sorted((ROOT / folder).glob("[0-9][0-9]_*.ipynb"))):
        text = path.read_text(encoding="utf-8")
        if first not in text:  # reading a megabyte as JSON takes longer
            continue
        for cell in json.loads(text)["cells"]:
            if cell["cell_type"] == "code" and "".join(cell["source"]) == source and cell["outputs"]:
                return cell["outputs"]
    return []


def show_again(outputs: list[dict]) -> None:
    """Show stored outputs in the cell that runs."""
    from IPython.display import display

    for output in outputs:
        if output["output_type"] == "stream":
            print("".join(output["text"]), end="")
        elif output["output_type"] == "error":
            print(f"{output['ename']}: {output['evalue']}")
        else:
            data = {kind: _plain(kind, value) for kind, value in output["data"].items()}
            display(data, metadata=output["metadata"], raw=True)


def _plain(kind: str, value: object) -> object:
    """A stored value as a kernel sends it: text in one piece, pictures as bytes."""
    if isinstance(value, list) and not kind.endswith("json"):
        value = "".join(value)
    return b64decode(value) if kind in ("image/png", "image/jpeg") else value
