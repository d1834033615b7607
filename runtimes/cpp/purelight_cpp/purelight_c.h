// Functions of C over `purelight.h`, for a library that other languages load. Include it once, after
// a generated lamp, with PURELIGHT_OPEN as the function that opens it.
//
// Vectors are three floats each, rows follow one another. A function that can fail returns what is
// wrong, or a null pointer; the text stays until the next call of the same thread.

#pragma once

#include "purelight.h"

namespace purelight
{
namespace c
{
inline thread_local std::string fault;

// Runs something; returns its fault.
template<typename F>
const char* guarded(F action)
{
    try
    {
        action();
        return nullptr;
    }
    catch (const std::exception& error)
    {
        fault = error.what();
        return fault.c_str();
    }
}

static_assert(sizeof(Vec3) == 3 * sizeof(float) && sizeof(Vec2) == 2 * sizeof(float), "packed");

inline const Vec3* vectors(const float* numbers) { return reinterpret_cast<const Vec3*>(numbers); }
inline const Vec2* pairs(const float* numbers) { return reinterpret_cast<const Vec2*>(numbers); }
inline Vec3* vectors(float* numbers) { return reinterpret_cast<Vec3*>(numbers); }
inline Vec2* pairs(float* numbers) { return reinterpret_cast<Vec2*>(numbers); }
inline const Lamp& lamp(const void* handle) { return *static_cast<const Lamp*>(handle); }

inline Sphere sphere(const float* numbers)
{
    return {{numbers[0], numbers[1], numbers[2]}, numbers[3]};
}

inline Instance instance(const void* handle, const double* to_world, double dimmer)
{
    std::array<double, 16> rows;
    std::copy_n(to_world, 16, rows.begin());
    return {&lamp(handle), Placement(rows), static_cast<float>(dimmer)};
}

inline void put(const Sample& found, std::size_t k, float* toward, float* pdf)
{
    vectors(toward)[k] = found.toward;
    pdf[k] = found.pdf_solid_angle;
}
}  // namespace c
}  // namespace purelight

#if defined(_WIN32)
#define PURELIGHT_C extern "C" __declspec(dllexport)
#else
#define PURELIGHT_C extern "C" __attribute__((visibility("default")))
#endif

using std::size_t;

PURELIGHT_C const char* purelight_open(const char* folder, void** lamp)
{
    return purelight::c::guarded([&] { *lamp = PURELIGHT_OPEN(folder).release(); });
}

PURELIGHT_C void purelight_close(void* lamp) { delete static_cast<purelight::Lamp*>(lamp); }

// Networks

PURELIGHT_C const char* purelight_radiance(const void* lamp, size_t rows, const float* position,
                                           const float* normal, const float* outgoing, float* result)
{
    using namespace purelight::c;
    return guarded([&] {
        purelight::c::lamp(lamp).radiance(rows, vectors(position), vectors(normal),
                                          vectors(outgoing), vectors(result));
    });
}

PURELIGHT_C const char* purelight_transmittance(const void* lamp, size_t rows,
                                                const float* position, const float* normal,
                                                const float* outgoing, float* result)
{
    using namespace purelight::c;
    return guarded([&] {
        purelight::c::lamp(lamp).transmittance(rows, vectors(position), vectors(normal),
                                               vectors(outgoing), vectors(result));
    });
}

PURELIGHT_C const char* purelight_sample(const void* lamp, size_t rows, const float* point,
                                         const float* u, float* toward, float* pdf)
{
    using namespace purelight::c;
    return guarded([&] {
        for (size_t k = 0; k < rows; ++k)
            put(purelight::c::lamp(lamp).sample(vectors(point)[k], pairs(u)[k]), k, toward, pdf);
    });
}

PURELIGHT_C const char* purelight_pdf_solid_angle(const void* lamp, size_t rows, const float* point,
                                                  const float* toward, float* result)
{
    using namespace purelight::c;
    return guarded([&] {
        purelight::c::lamp(lamp).pdf_solid_angle(rows, vectors(point), vectors(toward), result);
    });
}

PURELIGHT_C const char* purelight_radiance_map(const void* lamp, size_t rows, const float* point,
                                               float* result)
{
    using namespace purelight::c;
    return guarded([&] { purelight::c::lamp(lamp).radiance_map(rows, vectors(point), result); });
}

// Measures

PURELIGHT_C void purelight_frame(size_t rows, const float* axis, float* tangent, float* bitangent)
{
    using namespace purelight::c;
    for (size_t k = 0; k < rows; ++k)
    {
        const purelight::Frame found = purelight::frame(vectors(axis)[k]);
        vectors(tangent)[k] = found.tangent;
        vectors(bitangent)[k] = found.bitangent;
    }
}

PURELIGHT_C void purelight_square_to_disk(size_t rows, const float* u, float* disk)
{
    using namespace purelight::c;
    for (size_t k = 0; k < rows; ++k) pairs(disk)[k] = purelight::square_to_disk(pairs(u)[k]);
}

PURELIGHT_C void purelight_disk_to_square(size_t rows, const float* disk, float* u)
{
    using namespace purelight::c;
    for (size_t k = 0; k < rows; ++k) pairs(u)[k] = purelight::disk_to_square(pairs(disk)[k]);
}

PURELIGHT_C void purelight_cap(size_t rows, const float* sphere, const float* point, float* axis,
                               float* one_minus_cos, float* outside)
{
    using namespace purelight::c;
    for (size_t k = 0; k < rows; ++k)
    {
        const purelight::Cap cap = purelight::cap(vectors(point)[k], purelight::c::sphere(sphere));
        vectors(axis)[k] = cap.axis;
        one_minus_cos[k] = cap.one_minus_cos;
        outside[k] = cap.outside;
    }
}

PURELIGHT_C void purelight_cap_to_direction(size_t rows, const float* sphere, const float* point,
                                            const float* u, float* toward, float* pdf)
{
    using namespace purelight::c;
    for (size_t k = 0; k < rows; ++k)
    {
        const purelight::Cap cap = purelight::cap(vectors(point)[k], purelight::c::sphere(sphere));
        const float even = cap.outside ? 1 / cap.solid_angle() : 0;
        put({purelight::cap_to_direction(pairs(u)[k], cap), even}, k, toward, pdf);
    }
}

PURELIGHT_C void purelight_direction_to_cap(size_t rows, const float* sphere, const float* point,
                                            const float* toward, float* u, float* inside)
{
    using namespace purelight::c;
    for (size_t k = 0; k < rows; ++k)
    {
        const purelight::Cap cap = purelight::cap(vectors(point)[k], purelight::c::sphere(sphere));
        const auto found = purelight::direction_to_cap(vectors(toward)[k], cap);
        pairs(u)[k] = found.u;
        inside[k] = found.inside;
    }
}

PURELIGHT_C void purelight_area_to_solid_angle(size_t rows, const float* point,
                                               const float* position, const float* normal,
                                               const float* pdf_area, float* result)
{
    using namespace purelight::c;
    for (size_t k = 0; k < rows; ++k)
        result[k] = purelight::area_to_solid_angle(pdf_area[k], vectors(point)[k],
                                                   vectors(position)[k], vectors(normal)[k]);
}

// Points of the exit surface, by three random numbers in each row.
PURELIGHT_C const char* purelight_sample_surface(const void* lamp, size_t rows, const float* u,
                                                 float* position, float* normal, float* pdf_area)
{
    using namespace purelight::c;
    return guarded([&] {
        const purelight::Surface& surface = purelight::c::lamp(lamp).surface;
        for (size_t k = 0; k < rows; ++k)
        {
            const auto found = surface.sample(u[3 * k], {u[3 * k + 1], u[3 * k + 2]});
            vectors(position)[k] = found.position;
            vectors(normal)[k] = found.normal;
            pdf_area[k] = found.pdf_area;
        }
    });
}

// Instances: `to_world` are the four rows of a matrix that takes columns.

PURELIGHT_C const char* purelight_instance_radiance(const void* lamp, const double* to_world,
                                                    double dimmer, size_t rows,
                                                    const float* position, const float* normal,
                                                    const float* outgoing, float* result)
{
    using namespace purelight::c;
    return guarded([&] {
        const auto placed = instance(lamp, to_world, dimmer);
        for (size_t k = 0; k < rows; ++k)
            vectors(result)[k] = placed.radiance(vectors(position)[k], vectors(normal)[k],
                                                 vectors(outgoing)[k]);
    });
}

PURELIGHT_C const char* purelight_instance_transmittance(const void* lamp, const double* to_world,
                                                         size_t rows, const float* position,
                                                         const float* normal, const float* outgoing,
                                                         float* result)
{
    using namespace purelight::c;
    return guarded([&] {
        const auto placed = instance(lamp, to_world, 1);
        for (size_t k = 0; k < rows; ++k)
            vectors(result)[k] = placed.transmittance(vectors(position)[k], vectors(normal)[k],
                                                      vectors(outgoing)[k]);
    });
}

PURELIGHT_C const char* purelight_instance_sample(const void* lamp, const double* to_world,
                                                  size_t rows, const float* point, const float* u,
                                                  float* toward, float* pdf)
{
    using namespace purelight::c;
    return guarded([&] {
        const auto placed = instance(lamp, to_world, 1);
        for (size_t k = 0; k < rows; ++k)
            put(placed.sample(vectors(point)[k], pairs(u)[k]), k, toward, pdf);
    });
}

PURELIGHT_C const char* purelight_instance_sample_map(const void* lamp, const double* to_world,
                                                      double dimmer, size_t rows,
                                                      const float* point, const float* u,
                                                      float* radiance, float* toward, float* pdf)
{
    using namespace purelight::c;
    return guarded([&] {
        const auto placed = instance(lamp, to_world, dimmer);
        for (size_t k = 0; k < rows; ++k)
        {
            const auto found = placed.sample_map(vectors(point)[k], pairs(u)[k]);
            vectors(radiance)[k] = found.radiance;
            put({found.toward, found.pdf_solid_angle}, k, toward, pdf);
        }
    });
}
