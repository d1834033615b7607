"""Functions of Slang that the printed networks call; only those that are called are written.

The trigonometric ones are ours, as shading languages promise about three digits of theirs. Their
polynomials are minimax fits (relative error below 1e-8 in exact arithmetic).
"""

from __future__ import annotations

import re
from collections.abc import Iterable

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
    # Languages leave open what % and / do with negative numbers; here none get in.
    "modulo": """\
int @_modulo(int a, int b)
{
    int rest = (a < 0 ? -1 - a : a) % b;
    return a < 0 ? b - 1 - rest : rest;
}""",
    "modulo_long": """\
int64_t @_modulo_long(int64_t a, int64_t b)
{
    int64_t rest = (a < 0 ? -1 - a : a) % b;
    return a < 0 ? b - 1 - rest : rest;
}""",
    "quotient": "int @_quotient(int a, int b) { return a < 0 ? -(-a / b) : a / b; }",
    "quotient_long": """\
int64_t @_quotient_long(int64_t a, int64_t b) { return a < 0 ? -(-a / b) : a / b; }""",
    "place": """\
int @_place(int i, int last) { return clamp(i < 0 ? i + last + 1 : i, 0, last); }""",
    # The quotient may be rounded up to a whole number.
    "rest": """\
float @_rest(float a, float b)
{
    float rest = a - b * trunc(a / b);
    return rest * a < 0.0 ? rest + (a < 0.0 ? -abs(b) : abs(b)) : rest;
}""",
    "sign": "float @_sign(float x) { return x > 0.0 ? 1.0 : (x < 0.0 ? -1.0 : 0.0); }",
    "sign_int": "int @_sign_int(int x) { return x > 0 ? 1 : (x < 0 ? -1 : 0); }",
    "sign_long": "int64_t @_sign_long(int64_t x) { return x > 0 ? 1 : (x < 0 ? -1 : 0); }",
    # Quarter turns in three parts, of which the first two have few digits and multiply exactly.
    "sine_of_quarter": """\
float @_sine_of_quarter(float x, float ahead)
{
    float n = floor(x * 0.636619772 + 0.5);
    float r = ((x - n * 1.5703125) - n * 0.000483751297) - n * 7.54978995e-08;
    float quarter = n + ahead - 4.0 * floor((n + ahead) * 0.25);
    float z = r * r;
    float sine = r + r * z * (-0.166666667 + z * (0.00833333333 + z * (-0.000198412698
        + z * 2.75573192e-06)));
    float cosine = 1.0 + z * (-0.5 + z * (0.0416666667 + z * (-0.00138888889
        + z * (2.48015873e-05 - z * 2.75573192e-07))));
    float size = (quarter == 1.0 || quarter == 3.0) ? cosine : sine;
    return quarter >= 2.0 ? -size : size;
}""",
    "sin": "float @_sin(float x) { return @_sine_of_quarter(x, 0.0); }",
    "cos": "float @_cos(float x) { return @_sine_of_quarter(x, 1.0); }",
    "atan": """\
float @_atan(float x)
{
    float size = abs(x);
    bool steep = size > 2.41421356;
    bool middle = !steep && size > 0.414213562;
    float t = steep ? -1.0 / size : (middle ? (size - 1.0) / (size + 1.0) : size);
    float z = t * t;
    float angle = t + t * z * (-0.333333155 + z * (0.199984894 + z * (-0.142438486
        + z * (0.105960006 - z * 0.0608345092))));
    angle += steep ? 1.57079633 : (middle ? 0.785398163 : 0.0);
    return x < 0.0 ? -angle : angle;
}""",
    "asin": """\
float @_asin(float x)
{
    float size = min(abs(x), 1.0);
    bool steep = size > 0.5;
    float z = steep ? 0.5 * (1.0 - size) : size * size;
    float t = steep ? sqrt(z) : size;
    float angle = t + t * z * (0.166667539 + z * (0.0749524175 + z * (0.0454771016
        + z * (0.0241475864 + z * 0.0422185932))));
    angle = steep ? 1.57079633 - 2.0 * angle : angle;
    return x < 0.0 ? -angle : angle;
}""",
}


def support(texts: Iterable[str], prefix: str, width: int) -> str:
    """The buffers and functions that some texts call.

    Arguments:
        prefix: what all names of the lamp begin with.
        width: of textures that stand for buffers, a power of two.
    """
    needed = _needed("\n".join(texts).replace(f"{prefix}_", "@_"))
    parts = [BUFFERS] if "four" in needed else []
    parts += [INTEGERS] if "four_integers" in needed else []
    parts += [text for name, text in FUNCTIONS.items() if name in needed]
    joined = "\n".join(part.strip("\n") for part in parts)
    shift = str(width.bit_length() - 1)
    return (
        joined.replace("$MASK$", str(width - 1)).replace("$SHIFT$", shift).replace("@", prefix)
        + "\n"
    )


def _needed(text: str) -> set[str]:
    """Names that are called, those inside our functions too."""
    found = set(re.findall(r"@_(\w+)\(", text))
    while True:
        more = {
            name
            for called in found & FUNCTIONS.keys()
            for name in re.findall(r"@_(\w+)\(", FUNCTIONS[called])
        }
        if more <= found:
            return found
        found |= more
