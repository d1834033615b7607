"""Functions that Slang and OSL write alike; `@` stands for the lamp's prefix.

The trigonometric ones are ours, as shading languages promise about three digits of theirs. Their
polynomials are minimax fits (relative error below 1e-8 in exact arithmetic).
"""

from __future__ import annotations

COMMON = {
    # Languages leave open what % and / do with negative numbers; here none get in.
    "modulo": """\
int @_modulo(int a, int b)
{
    int rest = (a < 0 ? -1 - a : a) % b;
    return a < 0 ? b - 1 - rest : rest;
}""",
    "quotient": "int @_quotient(int a, int b) { return a < 0 ? -(-a / b) : a / b; }",
    # The quotient may be rounded up to a whole number, and by more than one where it is vast.
    "rest": """\
float @_rest(float a, float b)
{
    float rest = a - b * trunc(a / b);
    float found = rest * a < 0.0 ? rest + (a < 0.0 ? -abs(b) : abs(b)) : rest;
    return abs(found) > abs(b) ? 0.0 : found;
}""",
    "sign": "float @_sign(float x) { return x > 0.0 ? 1.0 : (x < 0.0 ? -1.0 : 0.0); }",
    "sign_int": "int @_sign_int(int x) { return x > 0 ? 1 : (x < 0 ? -1 : 0); }",
    # Quarter turns in three parts, of which the first two have few digits and multiply exactly.
    # What is left is bounded: of vast angles it has no digit that is right, and a sine must stay
    # within one all the same.
    "sine_of_quarter": """\
float @_sine_of_quarter(float x, float ahead)
{
    float n = floor(x * 0.636619772 + 0.5);
    float left = ((x - n * 1.5703125) - n * 0.000483751297) - n * 7.54978995e-08;
    float r = left > 0.8 ? 0.8 : (left < -0.8 ? -0.8 : left);
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
    # In three parts, about 0, 45 and 90 degrees.
    "atan": """\
float @_atan(float x)
{
    float size = abs(x);
    float near = size > 0.414213562 ? (size - 1.0) / (size + 1.0) : size;
    float t = size > 2.41421356 ? -1.0 / size : near;
    float about = size > 2.41421356 ? 1.57079633 : (size > 0.414213562 ? 0.785398163 : 0.0);
    float z = t * t;
    float angle = about + (t + t * z * (-0.333333155 + z * (0.199984894 + z * (-0.142438486
        + z * (0.105960006 - z * 0.0608345092)))));
    return x < 0.0 ? -angle : angle;
}""",
    "asin": """\
float @_asin(float x)
{
    float size = min(abs(x), 1.0);
    float z = size > 0.5 ? 0.5 * (1.0 - size) : size * size;
    float t = size > 0.5 ? sqrt(z) : size;
    float part = t + t * z * (0.166667539 + z * (0.0749524175 + z * (0.0454771016
        + z * (0.0241475864 + z * 0.0422185932))));
    float angle = size > 0.5 ? 1.57079633 - 2.0 * part : part;
    return x < 0.0 ? -angle : angle;
}""",
}
