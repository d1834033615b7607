// PureLight for C++17: luminaires that purelight-shader has written, for renderers that go depth
// first. One header, no dependencies but the standard library.
//
// Equation numbers are those of spec/measures.md. All quantities are in the luminaire frame: metres,
// W/(m2 sr) per linear Rec.709 channel; `Instance` brings them to the world. Everything that is
// const may be called from several threads at once.

// No `#pragma once`: every lamp's folder has a copy, and a program may include several.
#ifndef PURELIGHT_H
#define PURELIGHT_H

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace purelight
{

// What the user can mend: a file that is missing or spoilt, a transform that no lamp can have.
struct Error : std::runtime_error
{
    using std::runtime_error::runtime_error;
};

struct Vec2
{
    float x, y;
};

struct Vec3
{
    float x, y, z;
};

inline Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
inline Vec3 operator*(Vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
inline Vec3 operator*(float s, Vec3 a) { return a * s; }
inline float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(Vec3 a, Vec3 b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float luminance(Vec3 c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }

constexpr float PI = 3.14159265358979f;
constexpr int MAP_SIDE = 16;
constexpr int MAP_CELLS = MAP_SIDE * MAP_SIDE;
constexpr int MAP_NUMBERS = 3 * MAP_CELLS;

// ---------------------------------------------------------------------------------------------
// Measures

struct Sphere
{
    Vec3 center;
    float radius;
};

struct Frame
{
    Vec3 tangent, bitangent;
};

// Eq. 1: completes a unit axis to a right-handed frame.
inline Frame frame(Vec3 n)
{
    const float rho = n.x * n.x + n.y * n.y;
    const bool below = n.z < 0, pole = below && rho < 1e-20f;
    const float ahead = 1 + std::fabs(n.z);
    const float k = below ? ahead / std::max(rho, 1e-20f) : 1 / ahead;
    const float kx = pole ? 0 : k * n.x, xx = pole ? 2 : kx * n.x;
    const float yy = pole ? 0 : k * n.y * n.y, xy = kx * n.y;
    return {{1 - xx, -xy, -n.x}, {-xy, 1 - yy, -n.y}};
}

// Eq. 2: the unit square to the unit disk, keeping areas.
inline Vec2 square_to_disk(Vec2 u)
{
    const float a = 2 * u.x - 1, b = 2 * u.y - 1;
    const bool wide = std::fabs(a) > std::fabs(b);
    const float r = wide ? a : b, minor = wide ? b : a;
    const float phi = r != 0 ? PI / 4 * minor / r : 0;
    const float along = r * std::cos(phi), across = r * std::sin(phi);
    return wide ? Vec2{along, across} : Vec2{across, along};
}

// Eq. 3: its inverse.
inline Vec2 disk_to_square(Vec2 p)
{
    const bool wide = std::fabs(p.x) > std::fabs(p.y);
    const float major = wide ? p.x : p.y, minor = wide ? p.y : p.x;
    const float sign = major > 0 ? 1.0f : (major < 0 ? -1.0f : 0.0f);
    const float r = sign * std::sqrt(p.x * p.x + p.y * p.y);
    const float t = major != 0 ? r * std::atan(minor / major) / (PI / 4) : 0;
    const auto unit = [](float x) { return std::min(std::max(0.5f * x + 0.5f, 0.0f), 1.0f); };
    return wide ? Vec2{unit(r), unit(t)} : Vec2{unit(t), unit(r)};
}

// The directions in which a sphere is seen; one_minus_cos is that of the half-angle.
struct Cap
{
    Vec3 axis;
    float one_minus_cos;
    bool outside;

    float solid_angle() const { return 2 * PI * one_minus_cos; }
};

// Eq. 4: free of cancellation at any distance.
inline Cap cap(Vec3 point, const Sphere& sphere)
{
    const auto scaled = [&](float c, float p) {
        return std::min(std::max((c - p) / sphere.radius, -1e15f), 1e15f);
    };
    const Vec3 offset{scaled(sphere.center.x, point.x), scaled(sphere.center.y, point.y),
                      scaled(sphere.center.z, point.z)};
    const float distance = std::sqrt(dot(offset, offset));
    const Vec3 axis = distance > 0 ? offset * (1 / std::max(distance, 1e-20f)) : Vec3{0, 0, 1};
    const float s = 1 / std::max(distance, 1.0f), square = s * s;
    return {axis, square / (1 + std::sqrt(1 - square)), distance > 1 + 1e-6f};
}

// Eq. 5: the unit square to directions of the cap, keeping areas.
inline Vec3 cap_to_direction(Vec2 u, const Cap& cap)
{
    const Frame f = frame(cap.axis);
    const Vec2 p = square_to_disk(u);
    const float m = (p.x * p.x + p.y * p.y) * cap.one_minus_cos;
    const float q = std::sqrt(cap.one_minus_cos * (2 - m));
    return cap.axis * (1 - m) + f.tangent * (q * p.x) + f.bitangent * (q * p.y);
}

struct SquareOfCap
{
    Vec2 u;
    bool inside;
};

// Eq. 6: its inverse; for directions beside the cap the nearest point of the rim.
inline SquareOfCap direction_to_cap(Vec3 toward, const Cap& cap)
{
    const Frame f = frame(cap.axis);
    const Vec3 delta = toward - cap.axis;
    const float m = 0.5f * dot(delta, delta);
    const float q = std::sqrt(std::max(cap.one_minus_cos * (2 - m), 1e-30f));
    const float x = dot(delta, f.tangent) / q, y = dot(delta, f.bitangent) / q;
    const float rho = x * x + y * y, shrink = 1 / std::sqrt(std::max(rho, 1.0f));
    return {disk_to_square({x * shrink, y * shrink}), rho <= 1 && m <= 1.5f};
}

// Eq. 8: a density per area as one per solid angle at the point from where it is seen.
inline float area_to_solid_angle(float pdf_area, Vec3 point, Vec3 position, Vec3 normal)
{
    const Vec3 offset = position - point;
    const float square = dot(offset, offset);
    const float cosine = std::fabs(dot(offset, normal)) / std::sqrt(square);
    return pdf_area * square / cosine;
}

// A direction and its density per solid angle; zero where none can be drawn.
struct Sample
{
    Vec3 toward;
    float pdf_solid_angle;
};

struct MapSample
{
    Vec3 radiance, toward;
    float pdf_solid_angle;
};

// Eq. 13: a direction by the luminance of a radiance map's cells, even inside a cell.
inline MapSample draw_from_map(const float* map, Vec2 u, const Cap& cap)
{
    const auto cell = [&](int k) { return Vec3{map[3 * k], map[3 * k + 1], map[3 * k + 2]}; };
    float total = 0;
    for (int k = 0; k < MAP_CELLS; ++k) total += luminance(cell(k));
    const float target = u.x * total;
    float reached = 0, own = 0, rest = 0;
    int chosen = 0;
    for (int k = 0; k < MAP_CELLS; ++k)
    {
        const float y = luminance(cell(k));
        if (!(y > 0)) continue;
        chosen = k, own = y, rest = (target - reached) / y;
        reached += y;
        if (reached > target) break;
    }
    if (!cap.outside || !(own > 0)) return {cell(chosen), cap.axis, 0};
    rest = std::min(std::max(rest, 0.0f), 1.0f);
    const Vec2 place{(chosen % MAP_SIDE + rest) / MAP_SIDE, (chosen / MAP_SIDE + u.y) / MAP_SIDE};
    const float pdf = MAP_CELLS * (own / total) / cap.solid_angle();
    return {cell(chosen), cap_to_direction(place, cap), pdf};
}

// ---------------------------------------------------------------------------------------------
// Files that purelight-shader writes

inline std::vector<char> read_bytes(const std::string& path)
{
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    if (!file) throw Error(path + ": cannot read");
    std::vector<char> bytes(static_cast<std::size_t>(file.tellg()));
    file.seekg(0);
    if (!file.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
        throw Error(path + ": cannot read");
    return bytes;
}

// Numbers of four bytes, little-endian, as many as the generated code expects.
template<typename T>
std::vector<T> read_numbers(const std::string& path, std::size_t count)
{
    static_assert(sizeof(T) == 4, "files hold numbers of four bytes");
    const std::uint16_t one = 1;
    if (*reinterpret_cast<const unsigned char*>(&one) != 1)
        throw Error(path + ": this machine is big-endian, the file is not");
    const std::vector<char> bytes = read_bytes(path);
    if (bytes.size() != count * sizeof(T))
        throw Error(path + ": does not belong to this code; write both anew");
    std::vector<T> numbers(count);
    if (count) std::memcpy(numbers.data(), bytes.data(), bytes.size());
    return numbers;
}

// Refuses a folder that was written of another bundle than the code: sizes alone may agree. Buffers
// that lie somewhere without their lamp.json are taken as they are.
inline void require_bundle(const std::string& folder, const std::string& digest)
{
    const std::string path = folder + "/lamp.json";
    if (!std::ifstream(path, std::ios::binary)) return;
    const std::vector<char> text = read_bytes(path);
    if (std::search(text.begin(), text.end(), digest.begin(), digest.end()) == text.end())
        throw Error(path + ": is of another lamp than this code; compile the code beside it");
}

// ---------------------------------------------------------------------------------------------
// The exit surface

struct SurfacePoint
{
    Vec3 position, normal;  // The normal on one side, which may be either.
    std::uint32_t triangle;
    float pdf_area;
};

// Triangles with the flux of each. Points are drawn by flux, a fifth of them by area, so that no
// triangle with radiance is missed.
class Surface
{
public:
    std::vector<float> positions;          // [V, 3] in metres
    std::vector<std::uint32_t> triangles;  // [T, 3]
    std::vector<float> flux;               // [T, 3] in W

    Surface(std::vector<float> p, std::vector<std::uint32_t> t, std::vector<float> f)
        : positions(std::move(p)), triangles(std::move(t)), flux(std::move(f))
    {
        for (std::uint32_t index : triangles)
            if (index >= positions.size() / 3) throw Error("the surface is spoilt; write it anew");
        const std::size_t count = triangles.size() / 3;
        std::vector<double> by_flux(count), by_area(count);
        for (std::size_t k = 0; k < count; ++k)
        {
            by_flux[k] = luminance({flux[3 * k], flux[3 * k + 1], flux[3 * k + 2]});
            by_area[k] = area(k);
            if (by_area[k] == 0) by_flux[k] = 0;
        }
        const double light = std::accumulate(by_flux.begin(), by_flux.end(), 0.0);
        const double skin = std::accumulate(by_area.begin(), by_area.end(), 0.0);
        if (skin == 0) return;  // Nothing can be drawn.
        const double share = light > 0 ? 0.2 : 1.0;
        double sum = 0;
        for (std::size_t k = 0; k < count; ++k)
        {
            const double lit = light > 0 ? (1 - share) * by_flux[k] / light : 0;
            reached_.push_back(sum += lit + share * by_area[k] / skin);
        }
        for (double& value : reached_) value /= sum;
    }

    // Area of a triangle in m2.
    double area(std::size_t triangle) const
    {
        const Doubles c = normal_(triangle);
        return 0.5 * std::sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
    }

    // Density per area with which `sample` draws points of a triangle.
    float pdf_area(std::size_t triangle) const
    {
        const double skin = area(triangle);
        if (reached_.empty() || skin == 0) return 0;
        const double before = triangle ? reached_[triangle - 1] : 0;
        return static_cast<float>((reached_[triangle] - before) / skin);
    }

    // A point by three random numbers; pdf_area is zero if there is none.
    SurfacePoint sample(float choice, Vec2 u) const
    {
        if (reached_.empty()) return {{0, 0, 0}, {0, 0, 1}, 0, 0};
        const auto found = std::upper_bound(reached_.begin(), reached_.end(), double(choice));
        const auto last = static_cast<std::ptrdiff_t>(reached_.size()) - 1;
        const auto k = static_cast<std::size_t>(std::min(found - reached_.begin(), last));
        const float root = std::sqrt(u.x);
        const Vec3 a = corner(k, 0), b = corner(k, 1), c = corner(k, 2);
        const Vec3 position = a + root * ((1 - u.y) * (b - a) + u.y * (c - a));
        return {position, normal(k), static_cast<std::uint32_t>(k), pdf_area(k)};
    }

    Vec3 corner(std::size_t triangle, int which) const
    {
        const float* p = &positions[3 * triangles[3 * triangle + which]];
        return {p[0], p[1], p[2]};
    }

    // Unit normal of a triangle, on the side its corners say; zero where it has no area.
    Vec3 normal(std::size_t triangle) const
    {
        const Doubles c = normal_(triangle);
        const double length = std::sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
        const double scale = length > 0 ? 1 / length : 0;
        return {float(c[0] * scale), float(c[1] * scale), float(c[2] * scale)};
    }

private:
    using Doubles = std::array<double, 3>;
    std::vector<double> reached_;  // Probability that a triangle or one before it is drawn.

    Doubles normal_(std::size_t triangle) const
    {
        double e[2][3];
        const std::uint32_t* t = &triangles[3 * triangle];
        for (int k = 0; k < 2; ++k)
            for (int axis = 0; axis < 3; ++axis)
                e[k][axis] = double(positions[3 * t[k + 1] + axis]) - positions[3 * t[0] + axis];
        return {e[0][1] * e[1][2] - e[0][2] * e[1][1], e[0][2] * e[1][0] - e[0][0] * e[1][2],
                e[0][0] * e[1][1] - e[0][1] * e[1][0]};
    }
};

// ---------------------------------------------------------------------------------------------
// The lamp

// What a lamp is, besides its networks.
struct Facts
{
    std::string digest;      // Of the bundle's manifest, in hexadecimal.
    Sphere bounding_sphere;  // About the exit surface.
    Vec3 flux;               // W
    float radiance_scale;    // Mean exitant radiance.
    float r_max;             // Farthest distance it was trained for, in radii.
    float uniform_fraction;  // Of the sampler's density.
    bool has_transparency, has_sampler, has_map;
};

// The functions of one lamp, which generated code implements, each for one row and for many.
class Lamp
{
public:
    const Facts facts;
    const Surface surface;

    virtual ~Lamp() = default;

    // Radiance that leaves the exit surface at a point; the normal is the triangle's, on the side
    // of `outgoing`.
    virtual Vec3 radiance(Vec3 position, Vec3 normal, Vec3 outgoing) const = 0;
    virtual void radiance(std::size_t rows, const Vec3* position, const Vec3* normal,
                          const Vec3* outgoing, Vec3* result) const = 0;

    // What comes through of the light behind the whole lamp; zero for a lamp that is opaque.
    virtual Vec3 transmittance(Vec3, Vec3, Vec3) const { return {0, 0, 0}; }
    virtual void transmittance(std::size_t rows, const Vec3* position, const Vec3* normal,
                               const Vec3* outgoing, Vec3* result) const
    {
        for (std::size_t k = 0; k < rows; ++k)
            result[k] = transmittance(position[k], normal[k], outgoing[k]);
    }

    // A direction toward the lamp from a point outside its sphere.
    virtual Sample sample(Vec3, Vec2) const { throw Error("this lamp has no sampler"); }
    virtual void sample(std::size_t rows, const Vec3* point, const Vec2* u, Sample* result) const
    {
        for (std::size_t k = 0; k < rows; ++k) result[k] = sample(point[k], u[k]);
    }

    // The density with which `sample` gives a direction.
    virtual float pdf_solid_angle(Vec3, Vec3) const { throw Error("this lamp has no sampler"); }
    virtual void pdf_solid_angle(std::size_t rows, const Vec3* point, const Vec3* toward,
                                 float* result) const
    {
        for (std::size_t k = 0; k < rows; ++k) result[k] = pdf_solid_angle(point[k], toward[k]);
    }

    // Mean radiance of the cells of the cap's square: [16, 16, 3] numbers, rows go with u.y.
    virtual void radiance_map(Vec3, float*) const { throw Error("this lamp has no radiance map"); }
    virtual void radiance_map(std::size_t rows, const Vec3* point, float* result) const
    {
        for (std::size_t k = 0; k < rows; ++k) radiance_map(point[k], result + k * MAP_NUMBERS);
    }

    // The cap in which the lamp is seen.
    Cap cap(Vec3 point) const { return purelight::cap(point, facts.bounding_sphere); }

protected:
    Lamp(Facts f, Surface s) : facts(std::move(f)), surface(std::move(s)) {}
};

// ---------------------------------------------------------------------------------------------
// Instances

// Where a lamp hangs, world = scale * rotation * local + translation (Eq. 11).
class Placement
{
public:
    // From the rows of a matrix that takes columns; refuses what is more than a rotation, a uniform
    // scale above zero and a translation.
    explicit Placement(const std::array<double, 16>& m)
    {
        for (double value : m)
            if (!std::isfinite(value)) throw Error("to_world is not finite");
        for (int k = 0; k < 4; ++k)
            if (std::fabs(m[12 + k] - (k == 3)) > 1e-8) throw Error("to_world is not affine");
        const auto at = [&](int row, int column) { return m[4 * row + column]; };
        double volume = 0;
        for (int k = 0; k < 3; ++k)
            volume += at(0, k) * (at(1, (k + 1) % 3) * at(2, (k + 2) % 3)
                                  - at(1, (k + 2) % 3) * at(2, (k + 1) % 3));
        if (!(volume > 0)) throw Error("to_world mirrors or flattens the lamp");
        scale = std::cbrt(volume);
        for (int row = 0; row < 3; ++row)
        {
            translation[row] = at(row, 3);
            for (int column = 0; column < 3; ++column)
                rotation[3 * row + column] = at(row, column) / scale;
        }
        for (int row = 0; row < 3; ++row)
            for (int other = 0; other < 3; ++other)
            {
                double sum = 0;
                for (int k = 0; k < 3; ++k) sum += rotation[3 * row + k] * rotation[3 * other + k];
                if (std::fabs(sum - (row == other)) > 1e-4)
                    throw Error("to_world shears the lamp or scales its axes differently");
            }
    }

    Vec3 point_to_local(Vec3 p) const
    {
        const double offset[3] = {p.x - translation[0], p.y - translation[1], p.z - translation[2]};
        return transposed_(offset, 1 / scale);
    }
    Vec3 direction_to_local(Vec3 d) const
    {
        const double given[3] = {d.x, d.y, d.z};
        return transposed_(given, 1);
    }
    Vec3 direction_to_world(Vec3 d) const { return turned_(d, 1, {0, 0, 0}); }
    Vec3 point_to_world(Vec3 p) const { return turned_(p, scale, translation); }

    double scale;
    std::array<double, 9> rotation;
    std::array<double, 3> translation;

private:
    Vec3 transposed_(const double (&v)[3], double factor) const
    {
        const auto row = [&](int k) {
            return float(factor * (rotation[k] * v[0] + rotation[3 + k] * v[1]
                                   + rotation[6 + k] * v[2]));
        };
        return {row(0), row(1), row(2)};
    }
    Vec3 turned_(Vec3 v, double factor, const std::array<double, 3>& offset) const
    {
        const auto row = [&](int k) {
            return float(factor * (rotation[3 * k] * v.x + rotation[3 * k + 1] * v.y
                                   + rotation[3 * k + 2] * v.z) + offset[k]);
        };
        return {row(0), row(1), row(2)};
    }
};

// A lamp in the world, at a level. It does not own the lamp.
struct Instance
{
    const Lamp* lamp;
    Placement placement;
    float dimmer = 1;

    // At a point of the exit surface with its triangle's normal, on either side.
    Vec3 radiance(Vec3 position, Vec3 normal, Vec3 outgoing) const
    {
        return dimmer * lamp->radiance(placement.point_to_local(position),
                                       side_(normal, outgoing),
                                       placement.direction_to_local(outgoing));
    }
    Vec3 transmittance(Vec3 position, Vec3 normal, Vec3 outgoing) const
    {
        return lamp->transmittance(placement.point_to_local(position), side_(normal, outgoing),
                                   placement.direction_to_local(outgoing));
    }
    Sample sample(Vec3 point, Vec2 u) const
    {
        const Sample found = lamp->sample(placement.point_to_local(point), u);
        return {placement.direction_to_world(found.toward), found.pdf_solid_angle};
    }
    float pdf_solid_angle(Vec3 point, Vec3 toward) const
    {
        return lamp->pdf_solid_angle(placement.point_to_local(point),
                                     placement.direction_to_local(toward));
    }
    // A direction from the radiance map, with the cell's radiance.
    MapSample sample_map(Vec3 point, Vec2 u) const
    {
        const Vec3 local = placement.point_to_local(point);
        float map[MAP_NUMBERS];
        lamp->radiance_map(local, map);
        MapSample found = draw_from_map(map, u, lamp->cap(local));
        return {dimmer * found.radiance, placement.direction_to_world(found.toward),
                found.pdf_solid_angle};
    }
    // A point of the exit surface in the world.
    SurfacePoint sample_surface(float choice, Vec2 u) const
    {
        const SurfacePoint found = lamp->surface.sample(choice, u);
        const auto square = static_cast<float>(placement.scale * placement.scale);
        return {placement.point_to_world(found.position),
                placement.direction_to_world(found.normal), found.triangle,
                found.pdf_area / square};
    }

private:
    Vec3 side_(Vec3 normal, Vec3 outgoing) const
    {
        return placement.direction_to_local(dot(normal, outgoing) < 0 ? -normal : normal);
    }
};

}  // namespace purelight

#endif  // PURELIGHT_H
