/// What the tests of 3MF and AMF share: packages made from texts, and what of them is shown where.
#pragma once

#include <fmt/format.h>
#include <zlib.h>

#include <string>
#include <utility>
#include <vector>

#include "tests/unit/import/UsdFixture.h"

namespace tessera {

using ZipParts = std::vector<std::pair<std::string, std::string>>;

/// A zip archive, deflated or stored; `isLong`: with sizes of 64 bits in each entry's extra field, as lib3mf writes
/// them.
inline std::string archiveOf(const ZipParts& parts, bool isDeflated = true, bool isLong = false) {
    const auto put = [](std::string& to, std::size_t value, int bytes) {
        for (int i = 0; i < bytes; ++i) to.push_back(static_cast<char>(value >> (8 * i) & 0xff));
    };
    std::string zip, list;
    for (const auto& [name, content] : parts) {
        std::string packed = content;
        if (isDeflated) {
            z_stream stream{};
            EXPECT_EQ(::deflateInit2(&stream, 9, Z_DEFLATED, -MAX_WBITS, 9, Z_DEFAULT_STRATEGY), Z_OK);
            packed.resize(::deflateBound(&stream, content.size()));
            stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
            stream.avail_in = static_cast<uInt>(content.size());
            stream.next_out = reinterpret_cast<Bytef*>(packed.data());
            stream.avail_out = static_cast<uInt>(packed.size());
            EXPECT_EQ(::deflate(&stream, Z_FINISH), Z_STREAM_END);
            packed.resize(stream.total_out);
            ::deflateEnd(&stream);
        }
        const std::size_t at = zip.size(), kLong = 0xffffffff;
        const auto sum = ::crc32(0, reinterpret_cast<const Bytef*>(content.data()), static_cast<uInt>(content.size()));
        std::string extra;
        if (isLong) {
            put(extra, 1, 2);
            put(extra, 24, 2);
            put(extra, content.size(), 8);
            put(extra, packed.size(), 8);
            put(extra, at, 8);
        }
        for (std::string* const to : {&zip, &list}) {
            const bool isList = to == &list;
            *to += isList ? std::string("PK\1\2\24\0", 6) : std::string("PK\3\4");
            put(*to, 20, 2);
            put(*to, 0, 2);
            put(*to, isDeflated ? 8 : 0, 2);
            put(*to, 0, 4);
            put(*to, sum, 4);
            put(*to, isLong ? kLong : packed.size(), 4);
            put(*to, isLong ? kLong : content.size(), 4);
            put(*to, name.size(), 2);
            put(*to, isList ? extra.size() : 0, 2);
        }
        put(list, 0, 10);
        put(list, isLong ? kLong : at, 4);
        zip += name + packed;
        list += name + extra;
    }
    const std::size_t begin = zip.size();
    zip += list + std::string("PK\5\6\0\0\0\0", 8);
    put(zip, parts.size(), 2);
    put(zip, parts.size(), 2);
    put(zip, list.size(), 4);
    put(zip, begin, 4);
    put(zip, 0, 2);
    return zip;
}

inline const std::string kThreeMfRelations =
    "<?xml version=\"1.0\"?><Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">"
    "<Relationship Id=\"r0\" Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\" "
    "Target=\"/3D/start.model\"/></Relationships>";

/// A model part. `attributes`: more of its first element.
inline std::string threeMfModel(const std::string& resources, const std::string& build,
                                const std::string& attributes = "unit=\"meter\"") {
    return fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model {} "
        "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" "
        "xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/material/2015/02\" "
        "xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\">\n<resources>\n{}\n</resources>\n"
        "<build>{}</build>\n</model>\n",
        attributes, resources, build);
}

/// A package of one model, and what lies beside it.
inline std::string threeMf(const std::string& model, const ZipParts& beside = {}) {
    ZipParts parts = {{"_rels/.rels", kThreeMfRelations}, {"3D/start.model", model}};
    parts.insert(parts.end(), beside.begin(), beside.end());
    return archiveOf(parts);
}

/// An object element.
inline std::string threeMfObject(int id, const std::string& content, const std::string& attributes = "") {
    return fmt::format("<object id=\"{}\" {}>{}</object>\n", id, attributes, content);
}

/// A mesh element: a square in the plane z = 0 from the origin to (1, 1), of two triangles; `first` and `second` are
/// attributes of theirs.
inline std::string squareMesh(const std::string& first = "", const std::string& second = "") {
    return fmt::format(
        "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"1\" "
        "z=\"0\"/><vertex x=\"0\" y=\"1\" z=\"0\"/></vertices><triangles><triangle v1=\"0\" v2=\"1\" v3=\"2\" {}/>"
        "<triangle v1=\"0\" v2=\"2\" v3=\"3\" {}/></triangles></mesh>",
        first, second);
}

/// A file of these bytes, imported, and its scene; fails the test where it is refused.
class PrintedScene {
public:
    /// `name`: "model.3mf" or "model.amf".
    PrintedScene(const std::string& name, const std::string& bytes)
        : scene_(read(name, bytes)), aspect_(ImportedScene(scene_)) {}

    [[nodiscard]] const ImportedScene& scene() const { return scene_; }
    [[nodiscard]] bool notes(std::string_view text) const { return hasNote(scene_, text); }
    [[nodiscard]] std::string notes() const { return notesIn(scene_); }
    [[nodiscard]] std::vector<Vec3d> corners() const { return shownCorners(*aspect_); }
    [[nodiscard]] bool has(const std::string& path) const { return findNode(*aspect_, "/model" + path).has_value(); }
    template <typename Core>
    [[nodiscard]] std::vector<const Core*> all() const {
        return allOf<Core>(aspect_);
    }
    [[nodiscard]] Box bounds() const {
        Box box;
        for (const Vec3d& corner : corners()) box.extend(corner);
        return box;
    }

private:
    static ImportedScene read(const std::string& name, const std::string& bytes) {
        const Scratch folder;
        Expected<ImportedScene> scene = importScene(folder.write(name, bytes), kRootNode, importOptions());
        EXPECT_TRUE(scene) << messageOf(scene);
        return scene ? std::move(*scene) : ImportedScene();
    }

    ImportedScene scene_;
    ImportedAspect aspect_;
};

}  // namespace tessera
