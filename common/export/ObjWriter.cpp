// Wavefront OBJ in world coordinates, with a library of materials and pictures beside it.

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <map>

#include "common/export/Companions.h"
#include "common/export/Formats.h"
#include "common/export/LeavingBytes.h"
#include "common/export/LeavingLooks.h"
#include "common/export/LeavingPictures.h"
#include "common/export/UniqueNames.h"
#include "common/export/WorldMeshes.h"

namespace tessera {
namespace {

/// On one line, whatever the node is called.
std::string objName(std::string_view name) {
    std::string plain(name);
    for (char& c : plain)
        if (static_cast<unsigned char>(c) < 0x20 || c == '#' || c == '\\') c = '_';
    const std::size_t first = plain.find_first_not_of(' ');
    return first == std::string::npos ? "node" : plain.substr(first, plain.find_last_not_of(' ') + 1 - first);
}

class ObjWriter {
public:
    explicit ObjWriter(const LeavingScene& leaving) : leaving_(leaving), companions_(leaving.path) {}

    Expected<LeavingFiles> run() {
        const Expected<std::vector<WorldMesh>> meshes = worldMeshes(leaving_);
        if (!meshes) return tl::unexpected(meshes.error());
        bool hasLooks = false;
        for (const WorldMesh& mesh : *meshes)
            hasLooks = hasLooks || mesh.arrays.kind == MeshKind::kTriangles || mesh.material;
        parts_.emplace_back();  // the head, which lists what the others add
        for (const WorldMesh& mesh : *meshes)
            if (Expected<void> added = add(mesh); !added) return tl::unexpected(added.error());
        std::string library;
        if (hasLooks)
            library = fmt::format("mtllib {}\n", companions_.add("mtl", {sliceOfText(std::move(materials_))}, files_));
        parts_.front() = sliceOfText(fmt::format("# +Y up, lengths in metres\n# {}\n{}", companions_.mark(), library));
        files_.files.push_back({.path = leaving_.path, .parts = std::move(parts_)});
        return std::move(files_);
    }

private:
    /// Parts of a mesh are called as their node is; no name stands twice.
    std::string nameOf(const SelectedNode& node) {
        std::string_view name = node.node->name;
        const bool automatic = name.empty() || name == "geometry" || name.starts_with("part ");
        if (automatic && node.parent != SelectedNode::kNone) name = leaving_.selection.nodes[node.parent].node->name;
        return unique_.take(objName(name));
    }

    Expected<void> add(const WorldMesh& mesh) {
        ++files_.nodes;
        files_.triangles += mesh.triangles();
        std::string text = fmt::format("o {}\n", nameOf(*mesh.node));
        const bool surface = mesh.arrays.kind == MeshKind::kTriangles;
        if (surface || mesh.material) text += fmt::format("usemtl {}\n", material(mesh));
        const std::span<const std::uint8_t> colors = mesh.arrays.colors.as<std::uint8_t>();
        noteLostOpacities(colors, leaving_.notes, mesh.node->id);
        auto to = std::back_inserter(text);
        for (std::size_t v = 0; v < mesh.vertices(); ++v) {
            const Vec3f p = mesh.position(v);
            fmt::format_to(to, "v {} {} {}", p[0], p[1], p[2]);
            for (std::size_t k = 0; k < 3 && !colors.empty(); ++k)
                fmt::format_to(to, "{}{:.4f}", k == 0 ? " " : " ", colors[4 * v + k] / 255.0);
            text += '\n';
        }
        const auto* image = baseImage(mesh);
        const Blob& uv = image && image->texcoordSet == 1 ? mesh.arrays.texcoords1 : mesh.arrays.texcoords;
        const std::span<const float> texcoords = uv.as<float>();
        for (std::size_t v = 0; surface && v + 1 < texcoords.size(); v += 2) {
            Vec2f at(texcoords[v], texcoords[v + 1]);
            if (image) at = placedTexcoord(*image, at);
            if (!at.allFinite()) at.setZero();
            fmt::format_to(to, "vt {} {}\n", at[0], 1 - at[1]);  // from the lower left
        }
        const bool shaded = surface && !mesh.arrays.normals.empty();
        for (std::size_t v = 0; shaded && v < mesh.vertices(); ++v) {
            const Vec3f n = mesh.normal(v);
            fmt::format_to(to, "vn {} {} {}\n", n[0], n[1], n[2]);
        }
        addElements(mesh, !texcoords.empty(), shaded, text);
        vertices_ += mesh.vertices();
        if (surface && !texcoords.empty()) texcoords_ += mesh.vertices();
        if (shaded) normals_ += mesh.vertices();
        bytes_ += text.size();
        if (Expected<void> fits = checkFileBytes(bytes_, leaving_.options); !fits) return fits;
        parts_.push_back(sliceOfText(std::move(text)));
        return {};
    }

    void addElements(const WorldMesh& mesh, bool mapped, bool shaded, std::string& text) const {
        auto to = std::back_inserter(text);
        if (mesh.arrays.kind == MeshKind::kPoints)
            for (std::size_t v = 0; v < mesh.vertices(); ++v) fmt::format_to(to, "p {}\n", vertices_ + v + 1);
        const std::span<const std::uint32_t> lines = mesh.arrays.lines.as<std::uint32_t>();
        for (std::size_t i = 0; i + 1 < lines.size(); i += 2)
            fmt::format_to(to, "l {} {}\n", vertices_ + lines[i] + 1, vertices_ + lines[i + 1] + 1);
        for (std::size_t t = 0; t < mesh.triangles(); ++t) {
            text += 'f';
            for (const std::uint32_t c : mesh.corners(t)) {
                fmt::format_to(to, " {}", vertices_ + c + 1);
                if (mapped) fmt::format_to(to, "/{}", texcoords_ + c + 1);
                if (shaded) fmt::format_to(to, "{}{}", mapped ? "/" : "//", normals_ + c + 1);
            }
            text += '\n';
        }
    }

    [[nodiscard]] const Image* baseImage(const WorldMesh& mesh) const {
        const ObjectId id = materialOf(leaving_.scene, mesh.material).baseColorImage;
        return id ? leaving_.scene.get<Image>(id) : nullptr;
    }

    std::string material(const WorldMesh& mesh) {
        const auto [known, isNew] = known_.try_emplace(mesh.material, fmt::format("material_{}", known_.size()));
        if (!isNew) return known->second;
        const Material m = materialOf(leaving_.scene, mesh.material);
        const auto three = [](const Vec3f& c) { return fmt::format("{} {} {}", c[0], c[1], c[2]); };
        if (m.transmission > 0) leaving_.notes.add("light that goes through materials is left out", mesh.node->id);
        if (m.occlusionImage) leaving_.notes.add("images of occlusion are left out", mesh.node->id);
        if (!m.layers.empty() || m.program || !m.passes.empty())
            leaving_.notes.add("layers, passes and programs of materials are left out", mesh.node->id);
        const bool blends = m.alphaMode == Material::kBlend || m.alphaMode == Material::kAutoAlpha;
        materials_ += fmt::format("newmtl {}\nKd {}\nKe {}\nd {}\nNs {}\nPr {}\nPm {}\nillum 2\n", known->second,
                                  three(m.baseColor.head<3>()), three(m.emissive), blends ? m.baseColor[3] : 1.0f,
                                  2 / std::pow(std::max(m.roughness, 0.05f), 4.0f) - 2, m.roughness, m.metallic);
        const auto map = [&](std::string_view word, ObjectId id) {
            if (const std::string file = picture(id, mesh.node->id); !file.empty())
                materials_ += fmt::format("{} {}\n", word, file);
        };
        map("map_Kd", m.baseColorImage);
        map("map_Ke", m.emissiveImage);
        map("norm", m.normalImage);
        map("map_Pr", m.metallicRoughnessImage);
        map("map_Pm", m.metallicRoughnessImage);
        return known->second;
    }

    /// Its file's name; empty: none.
    std::string picture(ObjectId id, ObjectId node) {
        const auto* image = id ? leaving_.scene.get<Image>(id) : nullptr;
        if (!image || image->pixels.empty()) return {};
        const auto [known, isNew] = pictures_.try_emplace(image->pixels.id(), std::string());
        if (!isNew) return known->second;
        std::optional<Bytes> png = pngOf(*image, leaving_.notes, node);
        if (!png) return {};
        return known->second = companions_.addPicture(std::move(*png), files_);
    }

    const LeavingScene& leaving_;
    Companions companions_;
    LeavingFiles files_;
    std::vector<ByteSlice> parts_;
    std::string materials_;
    std::map<ObjectId, std::string> known_;
    std::map<BlobId, std::string> pictures_;
    UniqueNames unique_{"."};
    std::size_t vertices_ = 0, texcoords_ = 0, normals_ = 0;
    std::uint64_t bytes_ = 0;
};

}  // namespace

Expected<LeavingFiles> writeObj(const LeavingScene& leaving) {
    return ObjWriter(leaving).run();
}

}  // namespace tessera
