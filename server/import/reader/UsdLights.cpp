// Lights and cameras of USD.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/math/Decompositions.h"
#include "server/import/reader/UsdReader.h"

namespace tessera {
namespace {

constexpr double kUtmostRadiance = 1e15;

/// "inputs:NAME", or NAME alone, as it was called before 2021.
double lightNumber(const UsdComposedPrim& prim, const std::string& name, double otherwise) {
    return usdNumber(prim, "inputs:" + name, usdNumber(prim, name, otherwise));
}

Vec3d lightColor(const UsdComposedPrim& prim) {
    for (const char* name : {"inputs:color", "color"}) {
        const std::optional<UsdAttribute> attribute = prim.attribute(name);
        if (!attribute || !attribute->value) continue;
        const std::vector<double> said = attribute->value->numbers<double>();
        const Vec3d color = said.size() == 3 ? Vec3d(said[0], said[1], said[2]) : Vec3d(Vec3d::Ones());
        if (color.allFinite()) return color.cwiseMax(0).cwiseMin(1e6);
    }
    return Vec3d::Ones();
}

/// Of a black body, linear Rec. 709, of luminance 1, no channel below 0: Planck's law seen by the CIE's observer of
/// 1931, as Wyman, Sloan and Shirley fitted it (Simple Analytic Approximations to the CIE XYZ Color Matching Functions,
/// 2013).
Vec3d blackBodyColor(double kelvin) {
    struct Lobe {
        int channel;
        double height, middle, below, above;  ///< nanometres
    };
    static constexpr Lobe kLobes[] = {{0, 0.362, 442.0, 16.0, 26.7},  {0, 1.056, 599.8, 37.9, 31.0},
                                      {0, -0.065, 501.1, 20.4, 26.2}, {1, 0.821, 568.8, 46.9, 40.5},
                                      {1, 0.286, 530.9, 16.3, 31.1},  {2, 1.217, 437.0, 11.8, 36.0},
                                      {2, 0.681, 459.0, 26.0, 13.8}};
    constexpr double kSecondRadiation = 1.438776877e7;  // nm K
    Vec3d seen = Vec3d::Zero();
    for (int nm = 380; nm <= 780; nm += 5) {
        const double power = std::pow(nm / 560.0, -5) / std::expm1(kSecondRadiation / (nm * kelvin));
        for (const Lobe& lobe : kLobes) {
            const double off = (nm - lobe.middle) / (nm < lobe.middle ? lobe.below : lobe.above);
            seen[lobe.channel] += power * lobe.height * std::exp(-0.5 * off * off);
        }
    }
    Mat3d rgb_T_xyz;
    rgb_T_xyz << 3.2404542, -1.5371385, -0.4985314, -0.9692660, 1.8760108, 0.0415560, 0.0556434, -0.2040259, 1.0572252;
    const Vec3d color = (rgb_T_xyz * (seen / seen.y())).cwiseMax(0);
    return color / color.dot(Vec3d(0.2126, 0.7152, 0.0722));
}

template <typename Message>
void setLight(Message& message, const Vec3d& color, double intensity, bool shadows) {
    message.mutable_color()->set_r(static_cast<float>(color.x()));
    message.mutable_color()->set_g(static_cast<float>(color.y()));
    message.mutable_color()->set_b(static_cast<float>(color.z()));
    message.set_intensity(static_cast<float>(intensity));
    message.set_shadows(shadows);
}

}  // namespace

/// UsdLux speaks of radiance: of a sun's disk, or of a surface that shines. Here a light's intensity is what makes a
/// white surface white: irradiance, or candela, over pi.
Expected<bool> UsdReader::addLight(const UsdComposedPrim& prim, const Above& inside, Node& node, bool ownNode) {
    using std::numbers::pi;
    const std::string& type = prim.type();
    if (!type.ends_with("Light") && type != "DomeLight_1") return false;
    const Affine3d& world_T_prim = inside.world_T_parent;
    for (const char* name : {"inputs:intensity", "inputs:exposure", "inputs:color", "intensity", "exposure", "color"})
        if (const std::optional<UsdAttribute> value = prim.attribute(name); value && value->samples.size() > 1)
            remarks_.add("lights that change over time shine as they do first", prim.path());
    const double said = lightNumber(prim, "intensity", type == "DistantLight" ? 50000 : 1) *
                        std::exp2(std::clamp(lightNumber(prim, "exposure", 0), -60.0, 60.0));
    Vec3d color = lightColor(prim);
    if (lightNumber(prim, "enableColorTemperature", 0) != 0)
        color = color.cwiseProduct(blackBodyColor(std::clamp(lightNumber(prim, "colorTemperature", 6500), 1e3, 1e4)));
    if (!(said >= 0 && said <= kUtmostRadiance)) {
        remarks_.add("lights whose intensity is no number from 0 to 1e15 are left out", prim.path());
        return true;
    }
    const bool normalized = lightNumber(prim, "normalize", 0) != 0;
    const double scale = std::cbrt(std::abs(world_T_prim.linear().determinant()));
    const auto length = [&](const char* name, double otherwise) {
        return std::clamp(std::abs(lightNumber(prim, name, otherwise)) * scale, 0.0, 1e9);
    };
    const auto lit = [&](double intensity, bool directional) {
        if (inside.hidden) return;
        lights_.push_back(
            {intensity * color.maxCoeff(), directional ? kNoFalloff : kInverseSquare, world_T_prim.translation()});
    };
    // All lights of USD cast them unless they say otherwise; here few can. So it counts where a file says so.
    const bool shadows = lightNumber(prim, "shadow:enable", 0) != 0;
    const auto shining = [&]() -> Node& {
        if (!ownNode) return node;
        Node& below = *node.add_node();
        below.set_name("light");
        return below;
    };
    if (type == "DomeLight" || type == "DomeLight_1") {
        if (inside.hidden) {
            remarks_.add("dome lights that are invisible are left out", prim.path());
            return true;
        }
        if (Expected<void> done = addDome(prim, world_T_prim, said, color); !done) return tl::unexpected(done.error());
        return true;
    }
    if (type == "DistantLight") {
        const double half = std::clamp(lightNumber(prim, "angle", 0.53), 0.0, 360.0) * pi / 360;
        const double sine = std::sin(std::min(half, pi / 2));
        const double intensity = std::min(normalized || half == 0 ? said / pi : said * sine * sine, kUtmostRadiance);
        Node& light = shining();
        setLight(*light.mutable_directional_light(), color, intensity, shadows);
        lit(intensity, true);
        return true;
    }
    // Of a surface of area A and radiance L: candela, as it is looked at from straight ahead.
    double area = 0, whole = 0;
    bool flat = true;
    if (type == "SphereLight") {
        const double radius = length("radius", 0.5);
        area = pi * radius * radius, whole = 4 * area, flat = false;
    } else if (type == "CylinderLight") {
        const double radius = length("radius", 0.5), tall = length("length", 1);
        area = 2 * radius * tall, whole = 2 * pi * radius * tall, flat = false;
    } else if (type == "DiskLight") {
        const double radius = length("radius", 0.5);
        area = whole = pi * radius * radius;
    } else if (type == "RectLight") {
        area = whole = length("width", 1) * length("height", 1);
        if (const std::optional<UsdAttribute> file = prim.attribute("inputs:texture:file"); file && file->value)
            remarks_.add("pictures of lights are left out", prim.path());
    } else {
        remarks_.add(fmt::format("lights of type {} are left out", type), prim.path());
        return true;
    }
    const double share = normalized ? (whole > 0 ? area / whole : 0.25) : area;
    const double intensity = std::min(said * share / pi, kUtmostRadiance);
    const double cone =
        usdNumber(prim, "inputs:shaping:cone:angle", usdNumber(prim, "shaping:cone:angle", flat ? 90 : 180));
    Node& light = shining();
    if (flat || cone < 90) {
        proto::scene::SpotLight& spot = *light.mutable_spot_light();
        setLight(spot, color, intensity, shadows);
        const double outer = std::clamp(cone, 0.0, 90.0);
        const double soft =
            std::clamp(usdNumber(prim, "inputs:shaping:cone:softness", flat && cone >= 90 ? 1 : 0), 0.0, 1.0);
        spot.set_outer_angle_deg(static_cast<float>(outer));
        spot.set_inner_angle_deg(static_cast<float>(outer * (1 - soft)));
        if (flat) remarks_.add("flat lights shine from their middle", prim.path());
    } else {
        setLight(*light.mutable_point_light(), color, intensity, shadows);
    }
    lit(intensity, false);
    return true;
}

Expected<void> UsdReader::addDome(const UsdComposedPrim& prim, const Affine3d& world_T_prim, double strength,
                                  const Vec3d& color) {
    if (std::exchange(dome_, true)) {
        remarks_.add("dome lights beyond the first are left out", prim.path());
        return {};
    }
    Node& node = *scene_.file.add_node();
    node.set_name(prim.name());
    proto::scene::Environment& environment = *node.mutable_environment();
    std::optional<UsdAttribute> file = prim.attribute("inputs:texture:file");
    if (!file) file = prim.attribute("texture:file");
    const std::string image = file ? materials_.surroundings(*file, prim.path()) : "";
    const Vec3d light = strength * color;
    if (!image.empty()) {
        environment.set_image(image);
        environment.set_show_image(true);
        environment.set_strength(static_cast<float>(std::min(light.mean(), 1e6)));
        if (color != Vec3d::Ones()) remarks_.add("colours of dome lights with a picture are left out", prim.path());
        // The middle of the picture lies along its +Z, ours along -Z.
        const Vec3d middle = world_T_prim.linear() * Vec3d::UnitZ();
        const bool z = scene_.file.up_axis() == 3;
        const double turn = z ? std::atan2(-middle.x(), middle.y()) : std::atan2(-middle.x(), -middle.z());
        environment.set_turn_deg(static_cast<float>(turn * 180 / std::numbers::pi));
        return {};
    }
    for (proto::scene::Color* to : {environment.mutable_sky(), environment.mutable_ground()}) {
        to->set_r(static_cast<float>(std::min(light.x(), 1e6)));
        to->set_g(static_cast<float>(std::min(light.y(), 1e6)));
        to->set_b(static_cast<float>(std::min(light.z(), 1e6)));
    }
    return {};
}

void UsdReader::addCameras() {
    for (const Camera& camera : cameras_) {
        const UsdComposedPrim& prim = *camera.prim;
        // Tenths of a scene's unit, all of them.
        const double aperture = usdNumber(prim, "verticalAperture", 15.2908);
        const double focal = usdNumber(prim, "focalLength", 50);
        ModelCamera said{.name = "camera", .fieldOfView = std::nullopt, .height = 0};
        if (usdWord(prim, "projection", "perspective") == "perspective")
            said.fieldOfView = focal > 0 ? 2 * std::atan(0.5 * aperture / focal) : 0;
        else
            said.height = std::abs(aperture) / 10 * std::cbrt(std::abs(camera.world_T_prim.linear().determinant()));
        for (const char* name : {"focalLength", "verticalAperture"})
            if (const std::optional<UsdAttribute> value = prim.attribute(name); value && value->samples.size() > 1)
                remarks_.add("cameras that zoom look as they do first", prim.path());
        if (!addModelCamera(said, camera.world_T_prim, bounds_, scene_, *camera.node))
            remarks_.add("cameras that can show nothing are left out", prim.path());
    }
}

}  // namespace tessera
