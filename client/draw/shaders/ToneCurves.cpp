#include "client/draw/shaders/ToneCurves.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/Error.h"
#include "common/cores/Environment.h"

namespace tessera {
namespace {

/// As much of GLSL as ToneCurves.glsl needs, of doubles.
namespace glsl {

struct vec3 {
    explicit vec3(double all) : r(all), g(all), b(all) {}
    vec3(double red, double green, double blue) : r(red), g(green), b(blue) {}
    double r, g, b;
};

template <typename Of>
vec3 each(const vec3& a, const vec3& b, Of of) {
    return {of(a.r, b.r), of(a.g, b.g), of(a.b, b.b)};
}
vec3 operator+(const vec3& a, const vec3& b) {
    return each(a, b, [](double x, double y) { return x + y; });
}
vec3 operator-(const vec3& a, const vec3& b) {
    return each(a, b, [](double x, double y) { return x - y; });
}
vec3 operator*(const vec3& a, const vec3& b) {
    return each(a, b, [](double x, double y) { return x * y; });
}
vec3 operator/(const vec3& a, const vec3& b) {
    return each(a, b, [](double x, double y) { return x / y; });
}
vec3 operator*(const vec3& a, double b) {
    return a * vec3(b);
}
vec3 operator*(double a, const vec3& b) {
    return vec3(a) * b;
}
double min(double a, double b) {
    return std::min(a, b);
}
double max(double a, double b) {
    return std::max(a, b);
}
vec3 min(const vec3& a, const vec3& b) {
    return each(a, b, [](double x, double y) { return std::min(x, y); });
}
vec3 max(const vec3& a, const vec3& b) {
    return each(a, b, [](double x, double y) { return std::max(x, y); });
}
vec3 clamp(const vec3& v, const vec3& least, const vec3& most) {
    return min(max(v, least), most);
}
vec3 mix(const vec3& a, const vec3& b, double share) {
    return a * (1 - share) + b * share;
}
vec3 pow(const vec3& a, const vec3& b) {
    return each(a, b, [](double x, double y) { return std::pow(x, y); });
}
vec3 log2(const vec3& v) {
    return {std::log2(v.r), std::log2(v.g), std::log2(v.b)};
}

/// Of columns.
struct mat3 {
    mat3(const vec3& a, const vec3& b, const vec3& c) : first(a), second(b), third(c) {}
    vec3 first, second, third;
};
vec3 operator*(const mat3& m, const vec3& v) {
    return m.first * v.r + m.second * v.g + m.third * v.b;
}

#define float double
#include "client/draw/shaders/glsl/ToneCurves.glsl"
#undef float

}  // namespace glsl

struct Curve {
    std::string_view name;
    glsl::vec3 (*of)(glsl::vec3);
};

/// By Environment::toneMap.
const Curve& curveOf(std::int64_t toneMap) {
    static_assert(Environment::kNeutral == 0 && Environment::kClamp == 1 && Environment::kReinhard == 2 &&
                  Environment::kAces == 3 && Environment::kAgx == 4);
    static constexpr std::array<Curve, 5> kCurves{{{"neutral", glsl::neutral},
                                                   {"clipped", glsl::clipped},
                                                   {"reinhard", glsl::reinhard},
                                                   {"aces", glsl::aces},
                                                   {"agx", glsl::agx}}};
    TESSERA_CHECK(toneMap >= 0 && toneMap < static_cast<std::int64_t>(kCurves.size()), "a tone map of the table");
    return kCurves[static_cast<std::size_t>(toneMap)];
}

}  // namespace

std::string_view toneCurveOf(std::int64_t toneMap) {
    return curveOf(toneMap).name;
}

Vec3d toneMapped(std::int64_t toneMap, const Vec3d& radiance) {
    const glsl::vec3 shown = curveOf(toneMap).of({radiance.x(), radiance.y(), radiance.z()});
    return {shown.r, shown.g, shown.b};
}

}  // namespace tessera
