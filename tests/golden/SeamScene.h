/// A scene with everything that can make a seam show: coincident faces, mipmaps, metal, glass, facets, thin things,
/// points, surfaces that every host derives for itself.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "common/cores/ComponentTransform.h"
#include "common/cores/Environment.h"
#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/cores/SubdivisionSurface.h"
#include "common/geometry/Points.h"
#include "common/wall/Wall.h"
#include "tests/golden/TestScene.h"
#include "tests/unit/drawable/ControlCube.h"

namespace tessera::test {

/// Things whose materials say all by images: normals, metal and roughness, light, holes; lacquer, and glass that
/// colours.
inline void addMappedThings(TestScene& scene) {
    const auto image = [&](auto&& of) {
        std::vector<std::uint8_t> pixels;
        for (int y = 0; y < 32; ++y)
            for (int x = 0; x < 32; ++x)
                for (const double value : of(x / 32.0, y / 32.0))
                    pixels.push_back(static_cast<std::uint8_t>(std::clamp(255 * value, 0.0, 255.0)));
        return Image{.pixels = Blob::of(std::span<const std::uint8_t>(pixels)), .widthPx = 32, .heightPx = 32};
    };
    using Rgba = std::array<double, 4>;
    const double turn = 6.283185307;
    Material mapped;
    mapped.baseColor = Vec4f(0.9f, 0.8f, 0.7f, 1);
    mapped.metallic = mapped.roughness = 1;
    mapped.normalImage = scene.add(image([&](double u, double v) {
        return Rgba{0.5 + 0.3 * std::sin(3 * turn * u), 0.5 + 0.3 * std::cos(2 * turn * v), 0.85, 1};
    }));
    Image rough = image([&](double u, double v) { return Rgba{0.7 + 0.3 * v, 0.2 + 0.7 * u, v > 0.5 ? 0.9 : 0.1, 1}; });
    rough.rotation = 0.4f;
    rough.scale = {2.5f, 1.5f};
    rough.wrapU = Image::kMirror;
    mapped.metallicRoughnessImage = mapped.occlusionImage = scene.add(rough);
    mapped.emissive = Vec3f(0.2f, 0.5f, 1.5f);
    mapped.emissiveImage = scene.add(image([&](double u, double v) {
        const double spot = std::max(0.0, 1 - 40 * ((u - 0.5) * (u - 0.5) + (v - 0.3) * (v - 0.3)));
        return Rgba{spot, spot, spot, 1};
    }));
    Material holes;
    holes.alphaMode = Material::kMask;
    holes.doubleSided = true;
    holes.baseColorImage = scene.add(image([&](double u, double v) {
        return Rgba{0.3, 0.7, 0.3, 0.5 + 0.5 * std::sin(4 * turn * u) * std::sin(3 * turn * v)};
    }));
    Material lacquered;
    lacquered.baseColor = Vec4f(0.6f, 0.05f, 0.05f, 1);
    lacquered.clearcoat = 1;
    lacquered.clearcoatRoughness = 0.1f;
    Material coloured;
    coloured.baseColor = Vec4f(0.9f, 0.6f, 0.2f, 1);
    coloured.transmission = 0.8f;
    coloured.normalImage = mapped.normalImage;
    for (int i = 0; i < 14; ++i) {
        const double a = 0.45 * i;
        const std::array<Vec3d, 2> ends{Vec3d(3 * std::cos(a), 2 * std::sin(a), -3),
                                        Vec3d(-3 * std::sin(2 * a), std::cos(a), 1.5 - i)};
        scene.place(scene.add(makeLines(ends, i % 2 ? 1.0f : 3.0f + static_cast<float>(i)), scene.add(holes)),
                    Vec3d::Zero());
        Material plain;
        plain.baseColor = Vec4f(0.9f, 0.2f + 0.05f * static_cast<float>(i), 0.1f, i % 3 ? 1 : 0.5f);
        scene.place(scene.add(makeLines(ends, i % 2 ? 1.0f : 2.5f), scene.add(plain)), {0.1, 0.1, -0.5});
    }
    const ObjectId looks[] = {scene.add(mapped), scene.add(holes), scene.add(lacquered), scene.add(coloured)};
    for (int i = 0; i < 12; ++i) {
        MeshData shape = i % 3 == 2 ? makeBox({0.5, 0.5, 0.5}) : makeSphere(0.3, 24);
        shape.texcoords.clear();
        for (std::size_t k = 0; k < shape.positions.size(); k += 3)
            shape.texcoords.insert(shape.texcoords.end(),
                                   {1.5f * shape.positions[k] + 0.3f * shape.positions[k + 2],
                                    1.7f * shape.positions[k + 1] - 0.4f * shape.positions[k + 2]});
        const Quatd way(Eigen::AngleAxisd(0.5 * i, Vec3d(2, 1, 3).normalized()));
        scene.place(scene.add(shape, looks[i % 4]), {-1.4 + 0.26 * i, 0.9 * std::cos(1.3 * i), -0.9 - 0.1 * i}, way,
                    Vec3d(i % 5 ? 1 : -1, 1, 1));
    }
}

/// Surroundings that are a picture, a sun and spots with shadows, with `lamps` point lights that have some, too, and
/// many lights of short range.
inline void addManyLights(TestScene& scene, bool lamps) {
    std::vector<std::uint8_t> pixels;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 128; ++x)
            pixels.insert(pixels.end(), {static_cast<std::uint8_t>(60 + 2 * y), static_cast<std::uint8_t>(70 + x),
                                         static_cast<std::uint8_t>(200 - 2 * y),
                                         static_cast<std::uint8_t>((x / 9 + y / 7) % 11 == 0 ? 131 : 127)});
    Environment environment;
    environment.image = scene.add(Image{.pixels = Blob::of(std::span<const std::uint8_t>(pixels)),
                                        .widthPx = 128,
                                        .heightPx = 64,
                                        .encoding = Image::kRgbe});
    environment.strength = 0.5f;
    environment.turn = 0.7f;
    environment.showImage = true;
    scene.addEnvironment(environment);
    scene.addDirectionalLight({-0.5, -0.7, -0.3}, {1, 0.95f, 0.8f}, 0.8f, true);
    scene.addSpotLight({1.5, 3, 0}, {-0.3, -0.8, -0.5}, {0.6f, 0.8f, 1}, 9, 0.3f, 0.6f, 0, true);
    scene.addSpotLight({-2, 2.5, -1}, {0.4, -0.8, -0.6}, {1, 0.6f, 0.5f}, 8, 0.2f, 0.7f, 12, true);
    if (lamps) {
        scene.addPointLight({0.3, 1.2, -4}, {1, 0.9f, 0.7f}, 5, 0, Vec3f(0, 0, 1), true);
        scene.addPointLight({-1, 0.4, -7.5}, {0.5f, 0.7f, 1}, 6, 9, Vec3f(0, 0, 1), true);
    }
    for (int i = 0; i < 90; ++i)
        scene.addPointLight({3.5 * std::sin(2.4 * i), -0.8 + 0.03 * i, -0.5 - 0.16 * i},
                            {1, 0.3f + 0.007f * static_cast<float>(i), 0.4f}, 0.3f,
                            0.5f + 0.1f * static_cast<float>(i % 9));
}

[[nodiscard]] inline Aspect makeSeamScene(bool coincident = true, bool mapped = false, bool lit = false,
                                          bool lamps = false) {
    TestScene scene;
    if (lit) addManyLights(scene, lamps);
    if (mapped) addMappedThings(scene);
    std::vector<std::uint8_t> pixels;
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            const auto shade = static_cast<std::uint8_t>(((x / 4) ^ (y / 4)) & 1 ? 235 : 40);
            pixels.insert(pixels.end(),
                          {shade, static_cast<std::uint8_t>(3 * x), static_cast<std::uint8_t>(3 * y), 255});
        }
    }
    const auto material = [&](float r, float g, float b, float metallic, float roughness, float alpha = 1) {
        Material m;
        m.baseColor = Vec4f(r, g, b, alpha);
        m.metallic = metallic;
        m.roughness = roughness;
        return m;
    };
    Material tiled = material(1, 1, 1, 0, 0.5f);
    tiled.baseColorImage = scene.addImage(Blob::of(std::span<const std::uint8_t>(pixels)), 64, 64);
    const ObjectId floor = scene.add(makeSheet(40, 40, 25), scene.add(tiled));
    scene.place(floor, {0, -1, -12}, Quatd(Eigen::AngleAxisd(-1.5707963, Vec3d::UnitX())));
    const ObjectId wall = scene.add(makeBox({30, 8, 0.3}), scene.add(material(0.6f, 0.55f, 0.5f, 0, 0.9f)));
    scene.place(wall, {0, 2, -16});

    const ObjectId steel = scene.add(material(0.8f, 0.8f, 0.85f, 1, 0.15f));
    const ObjectId gold = scene.add(material(0.95f, 0.7f, 0.3f, 1, 0.3f));
    const ObjectId red = scene.add(material(0.7f, 0.1f, 0.1f, 0, 0.4f));
    const ObjectId glass = scene.add(material(0.3f, 0.7f, 0.8f, 0, 0.1f, 0.35f));
    for (int i = 0; i < 24; ++i) {
        const Vec3d at(3.2 * std::sin(1.7 * i), -0.6 + 0.12 * i, -2.0 - 0.4 * i);
        const Quatd turn(Eigen::AngleAxisd(0.7 * i, Vec3d(1, 2, 3).normalized()));
        MeshData shape = i % 3 == 0   ? makeTorus(0.5, 0.17, 40, 20)
                         : i % 3 == 1 ? makeSphere(0.45, 32)
                                      : makeBox({0.7, 0.7, 0.7});
        if (i % 4 == 1) shape.normals.clear();
        const ObjectId geometry = scene.add(shape, i % 2 ? steel : gold);
        scene.place(geometry, at, turn, Vec3d(i % 5 ? 1 : -1, 1, 1));
    }
    // Coincident faces: the same box twice in two colours, and boxes that share a plane.
    const ObjectId redBox = scene.add(makeBox({1, 1, 1}), red);
    const ObjectId steelBox = scene.add(makeBox({1, 1, 1}), steel);
    const Quatd turn(Eigen::AngleAxisd(0.5, Vec3d(0.2, 1, 0.1).normalized()));
    scene.place(redBox, {0, 0, -3}, turn);
    if (coincident) {
        scene.place(steelBox, {0, 0, -3}, turn);
        scene.place(steelBox, Vec3d(0, 0, -3) + turn * Vec3d(0.5, 0.25, 0), turn);
        scene.place(redBox, Vec3d(0, 0, -3) + turn * Vec3d(-0.5, -0.5, 0), turn);
    }
    // Rods thinner than a pixel, and panes one behind the other.
    const ObjectId rod = scene.add(makeCylinder(0.004, 12, 6), red);
    for (int i = 0; i < 10; ++i)
        scene.place(rod, {-3 + 0.63 * i, 0.5, -5}, Quatd(Eigen::AngleAxisd(0.2 + 0.11 * i, Vec3d::UnitZ())));
    MeshData pane = makeSheet(2.5, 1.8);
    const ObjectId panes = scene.add(pane, glass);
    for (int i = 0; i < 6; ++i)
        scene.place(panes, {-1.5 + 0.6 * i, 0.3, -1.5 - 0.5 * i}, Quatd(Eigen::AngleAxisd(0.2 * i, Vec3d::UnitY())));
    scene.place(scene.add(makeSphere(0.6, 32), glass), {0.9, -0.3, -1.2});
    // A ball that was scanned: points of a pixel or two.
    MeshData scan = *pointsOnSurface(makeSphere(0.7, 24), 0.03);
    scan.pointRadius = 0.012;
    scene.place(scene.add(scan, gold), {-1.1, 0.7, -2.6});
    // Others: of colours, some of them clear, over the wall; of glass; large ones, and through the near plane.
    for (int i = 0; i < 5; ++i) {
        MeshData cloud{.primitive = Primitive::kPoints,
                       .pointRadius = std::array{0.006, 0.02, 0.15, 0.5, 0.0}[static_cast<std::size_t>(i)]};
        for (int k = 0, count = i == 0 ? 9000 : i == 4 ? 300 : 40; k < count; ++k) {
            const double a = 2.399963 * k, r = (i == 3 ? 3.0 : 1.5) * std::sqrt((k + 0.5) / count);
            for (const double value : {r * std::cos(a), r * std::sin(a), 0.4 * std::sin(0.37 * k)})
                cloud.positions.push_back(static_cast<float>(value));
            const auto shade = static_cast<std::uint8_t>(7 * k);
            if (i % 2 == 0)
                cloud.colors.insert(cloud.colors.end(),
                                    {shade, 120, 220, static_cast<std::uint8_t>(i == 2 && k % 2 ? 100 : 255)});
        }
        Material paint = material(0.9f, 0.8f, 0.6f, 0, 0.6f, i == 1 ? 0.5f : 1);
        if (i == 2) paint.alphaMode = Material::kBlend;
        scene.place(scene.add(cloud, scene.add(paint)), {0.5 - 0.4 * i, 0.2 * i, i == 3 ? 1.2 : -2.0 - i},
                    Quatd(Eigen::AngleAxisd(0.4 * i, Vec3d::UnitX())));
    }

    // Surfaces of control points: every tile derives them for itself. Smooth, creased, faceted; one crosses all seams.
    for (int i = 0; i < 4; ++i) {
        SubdivisionSurface surface = controlGrid(i < 2 ? 1 : 2);
        surface.scheme = i == 3 ? SubdivisionSurface::kBilinear : SubdivisionSurface::kCatmullClark;
        surface.level = 2 + i;
        const std::uint32_t edges[] = {0, 1, 1, 2, 2, 3, 3, 0};
        if (i == 1) surface.creases = Blob::of(std::span<const std::uint32_t>(edges));
        surface.material = i % 2 ? steel : red;
        scene.place(scene.add(surface), {-0.9 + 0.7 * i, 0.1 * i, i == 2 ? -0.4 : -1.6 - 0.3 * i},
                    Quatd(Eigen::AngleAxisd(0.6 + 0.4 * i, Vec3d(1, 1, 0.3).normalized())),
                    Vec3d::Constant(i == 2 ? 0.12 : 0.35));
    }

    scene.addDirectionalLight({0.4, -0.8, -0.5}, {1, 0.95f, 0.9f}, 0.7f);
    scene.addPointLight({-2, 2, -3}, {1, 0.7f, 0.5f}, 3, 9);
    scene.addPointLight({2.5, 1.5, -5}, {0.5f, 0.7f, 1}, 4, 12);
    // A cone whose edge crosses the seams, and things that other transforms put there.
    scene.addSpotLight({0.2, 2.2, -1}, {-0.1, -0.8, -0.6}, {0.7f, 1, 0.6f}, 6, 0.15f, 0.45f);
    ComponentTransform about;
    about.center = Vec3d(0.4, 0, 0);
    about.rotation = Quatd(Eigen::AngleAxisd(0.6, Vec3d(1, 2, 3).normalized()));
    about.scaleOrientation = Quatd(Eigen::AngleAxisd(0.8, Vec3d::UnitZ()));
    about.scale = Vec3d(1.8, 0.4, 1);
    about.translation = Vec3d(-0.6, 0.9, -2.2);
    const ObjectId bent = scene.placeAbout(redBox, about);
    scene.addNode(redBox, scene.addTransform({0.3, 1.1, -2.4}, turn, Vec3d::Constant(0.5), scene.addInverse(bent)));
    return scene.take();
}

/// One flat screen, 3.2 m wide, cut into tiles that all belong to one host.
inline Wall makeWall(const Screen::Grid& grid, Eye eye = Eye::kCenter) {
    Wall wall;
    wall.name = "test";
    Screen screen;
    screen.name = "front";
    screen.grid = grid;
    const double width = 3.2;
    const ScreenPixels pixels = screenPixels(screen);
    const double height = width * pixels.height / pixels.width;
    screen.lowerLeft = {-width / 2, -height / 2, 0};
    screen.lowerRight = {width / 2, -height / 2, 0};
    screen.upperLeft = {-width / 2, height / 2, 0};
    wall.screens = {screen};
    wall.users = {User{.name = "viewer", .position = {0.3, 0.15, 2.1}}};
    WallHost host{.name = "all"};
    for (int row = 0; row < grid.rows; ++row)
        for (int column = 0; column < grid.columns; ++column)
            host.tiles.push_back({.screen = "front", .column = column, .row = row, .eye = eye, .user = "viewer"});
    wall.hosts = {host};
    return wall;
}

}  // namespace tessera::test
