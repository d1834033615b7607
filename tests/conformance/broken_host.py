"""A host that breaks down in the way its argument says, after it has said hello."""

from __future__ import annotations

import json
import math
import sys
import time
from typing import Any

GREETING = {"protocol": "1.0", "host": "broken", "version": "0", "operations": ["frame"]}
ARRAY = {"dtype": "<f4", "shape": [1, 3], "data": "AAAAAAAAAAAAAIA/"}


def answer(way: str, request: dict[str, Any]) -> str:
    """One line, or none that is worth the name."""
    reply: dict[str, Any] = {"id": request["id"]}
    if request["do"] == "hello" and way == "unwilling":
        return json.dumps({**reply, "refused": "no time"})
    if request["do"] == "hello":
        greetings = {"old": {"protocol": "0.9"}, "mute": {"operations": None}}
        return json.dumps({**reply, **GREETING, **greetings.get(way, {})})
    if way == "crash":
        print("first words", file=sys.stderr)
        sys.exit("segmentation fault, more or less")
    if way == "hang":
        time.sleep(60)
    refusal = json.dumps({**reply, "refused": "not today"})
    lines = {
        "garbage": "Loading model... done",
        "list": "[1, 2]",
        "deep": "[" * 100_000,
        "late": json.dumps({"id": 1, "outputs": {}}),
        "no_arrays": json.dumps({**reply, "outputs": 3}),
        "no_base64": json.dumps({**reply, "outputs": {"tangent": {**ARRAY, "data": "?"}}}),
        "wrong_size": json.dumps({**reply, "outputs": {"tangent": {**ARRAY, "shape": [9, 9]}}}),
        "wrong_type": json.dumps({**reply, "outputs": {"tangent": {**ARRAY, "dtype": "O"}}}),
        "wrong_shape": json.dumps({**reply, "outputs": {"tangent": ARRAY, "bitangent": ARRAY}}),
        "too_little": json.dumps({**reply, "outputs": {}}),
        "negative_size": json.dumps({**reply, "outputs": {"tangent": {**ARRAY, "shape": [-1, 3]}}}),
        "no_size": json.dumps({**reply, "outputs": {"tangent": {**ARRAY, "shape": [math.inf]}}}),
        "at_length": json.dumps({**reply, "refused": "not today,\n\x1b[31mnor tomorrow"}),
        **dict.fromkeys(("refuses", "ends_badly", "never_ends", "goodbye"), refusal),
    }
    return lines.get(way, "")


if __name__ == "__main__":
    way = sys.argv[1]
    if way == "dead":
        sys.exit(3)
    for line in sys.stdin:
        print(answer(way, json.loads(line)), flush=True)
    if way == "goodbye":
        print("so long, and thanks for all the vectors" * 10_000)
    if way == "ends_badly":
        sys.exit(3)
    if way == "never_ends":
        time.sleep(60)
