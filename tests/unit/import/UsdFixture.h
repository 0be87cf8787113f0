/// What the tests of USD share: files in a folder of their own, and what of them is shown where.
#pragma once

#include <string>
#include <vector>

#include "common/cores/Geometry.h"
#include "common/drawable/Drawable.h"
#include "common/scene/Action.h"
#include "tests/unit/import/Picture.h"

namespace tessera {

inline const std::string kUsdFiles = TESSERA_SOURCE_DIR "/tests/data/usd/";

/// What is written into one file, with a head of metres where it has none.
inline std::string usda(const std::string& text) {
    return text.starts_with("#usda") ? text : "#usda 1.0\n(\n    metersPerUnit = 1\n)\n" + text;
}

inline Expected<ImportedScene> importUsd(const std::string& path) {
    return importScene(path, kRootNode, importOptions());
}

/// Corners of all triangles that are shown, in world coordinates, node after node.
inline std::vector<Vec3d> shownCorners(const Aspect& aspect) {
    std::vector<Vec3d> corners;
    Action collect;
    collect.onNode([&](const Visit& visit) {
        const Drawable drawable = drawableOf(aspect, visit.node);
        if (!drawable) return Descend::kInto;
        const MeshArrays arrays = drawable.arrays();
        const std::span<const float> xyz = arrays.positions.as<float>();
        for (const std::uint32_t i : arrays.indices.as<std::uint32_t>())
            corners.push_back(visit.world_T_node * Vec3d(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]));
        return Descend::kInto;
    });
    collect.run(aspect);
    return corners;
}

/// A file of this text, imported, and its scene; fails the test where it is refused.
class UsdScene {
public:
    explicit UsdScene(const std::string& text, const std::vector<std::pair<std::string, std::string>>& beside = {})
        : scene_(read(folder_, text, beside)), aspect_(ImportedScene(scene_)) {}

    [[nodiscard]] const ImportedScene& scene() const { return scene_; }
    [[nodiscard]] const ImportedAspect& aspect() const { return aspect_; }
    [[nodiscard]] bool notes(std::string_view text) const { return hasNote(scene_, text); }
    [[nodiscard]] std::string notes() const { return notesIn(scene_); }
    [[nodiscard]] std::vector<Vec3d> corners() const { return shownCorners(*aspect_); }
    [[nodiscard]] Box bounds() const {
        Box box;
        for (const Vec3d& corner : corners()) box.extend(corner);
        return box;
    }
    /// Whether there is a node of this path below the file's own.
    [[nodiscard]] bool has(const std::string& path) const { return findNode(*aspect_, "/model" + path).has_value(); }
    template <typename Core>
    [[nodiscard]] std::vector<const Core*> all() const {
        return allOf<Core>(aspect_);
    }

private:
    static ImportedScene read(const Scratch& folder, const std::string& text,
                              const std::vector<std::pair<std::string, std::string>>& beside) {
        for (const auto& [name, content] : beside)
            folder.write(name, name.ends_with(".usda") ? usda(content) : content);
        Expected<ImportedScene> scene = importUsd(folder.write("model.usda", usda(text)));
        EXPECT_TRUE(scene) << messageOf(scene);
        return scene ? std::move(*scene) : ImportedScene();
    }

    Scratch folder_;
    ImportedScene scene_;
    ImportedAspect aspect_;
};

inline void expectNear(const Vec3d& is, const Vec3d& wanted, double error = 1e-5) {
    EXPECT_LE((is - wanted).norm(), error) << is.transpose() << " is not " << wanted.transpose();
}

/// One triangle in the plane z = 0, from the origin along x and y.
inline const std::string kUsdTriangle = R"(
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    uniform token subdivisionScheme = "none"
)";

}  // namespace tessera
