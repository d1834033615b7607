"""Functions of Slang that the printed networks call; only those that are called are written."""

from __future__ import annotations

from collections.abc import Iterable

from purelight_shader.printing.functions import COMMON
from purelight_shader.printing.printer import called

BUFFERS = """\
#ifdef PURELIGHT_TEXTURES
Texture2D<float4> @_floats;
float4 @_four(int i) { return @_floats.Load(int3(i & $MASK$, i >> $SHIFT$, 0)); }
#else
StructuredBuffer<float4> @_floats;
float4 @_four(int i) { return @_floats[i]; }
#endif
"""

INTEGERS = """\
#ifdef PURELIGHT_TEXTURES
Texture2D<int4> @_integers;
int4 @_four_integers(int i) { return @_integers.Load(int3(i & $MASK$, i >> $SHIFT$, 0)); }
#else
StructuredBuffer<int4> @_integers;
int4 @_four_integers(int i) { return @_integers[i]; }
#endif
"""

FUNCTIONS = {
    **COMMON,
    # On processors the library's functions, which mind what is no number, would be called.
    "max": """\
float @_max(float a, float b)
{
    __target_switch
    {
    case cpp: return a > b ? a : b;
    default: return max(a, b);
    }
}""",
    "min": """\
float @_min(float a, float b)
{
    __target_switch
    {
    case cpp: return a < b ? a : b;
    default: return min(a, b);
    }
}""",
    "number": "float @_number(int i) { return @_four(i >> 2)[i & 3]; }",
    "integer": "int @_integer(int i) { return @_four_integers(i >> 2)[i & 3]; }",
    # Not a number becomes `low`: what casts make of it differs between machines.
    "truncated": """\
int @_truncated(float x, float low, float high)
{
    return int(x >= low ? (x <= high ? x : high) : low);
}""",
    "truncated_long": """\
int64_t @_truncated_long(float x, float low, float high)
{
    return int64_t(x >= low ? (x <= high ? x : high) : low);
}""",
    "modulo_long": """\
int64_t @_modulo_long(int64_t a, int64_t b)
{
    int64_t rest = (a < 0 ? -1 - a : a) % b;
    return a < 0 ? b - 1 - rest : rest;
}""",
    "quotient_long": """\
int64_t @_quotient_long(int64_t a, int64_t b) { return a < 0 ? -(-a / b) : a / b; }""",
    "place": """\
int @_place(int i, int last) { return clamp(i < 0 ? i + last + 1 : i, 0, last); }""",
    "sign_long": "int64_t @_sign_long(int64_t x) { return x > 0 ? 1 : (x < 0 ? -1 : 0); }",
}


def support(texts: Iterable[str], prefix: str, width: int) -> str:
    """The buffers and functions that some texts call.

    Arguments:
        prefix: what all names of the lamp begin with.
        width: of textures that stand for buffers, a power of two.
    """
    needed = called("\n".join(texts), prefix, FUNCTIONS)
    parts = [BUFFERS] if "four" in needed else []
    parts += [INTEGERS] if "four_integers" in needed else []
    parts += [text for name, text in FUNCTIONS.items() if name in needed]
    joined = "\n".join(part.strip("\n") for part in parts)
    shift = str(width.bit_length() - 1)
    return (
        joined.replace("$MASK$", str(width - 1)).replace("$SHIFT$", shift).replace("@", prefix)
        + "\n"
    )
