#include "tests/bench/FormatFiles.h"

#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <meshoptimizer.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <span>
#include <utility>

namespace tessera::bench {
namespace {

class Output {
public:
    explicit Output(const std::string& path) : out_(path, std::ios::binary) {}
    ~Output() { flush(); }
    Output(const Output&) = delete;
    Output& operator=(const Output&) = delete;

    template <typename... Args>
    void text(fmt::format_string<Args...> format, Args&&... args) {
        fmt::format_to(std::back_inserter(buffer_), format, std::forward<Args>(args)...);
        if (buffer_.size() > 1 << 20) flush();
    }
    void raw(const std::string& bytes) {
        buffer_ += bytes;
        if (buffer_.size() > 1 << 20) flush();
    }
    template <typename Value>
    void value(const Value& value) {
        buffer_.append(reinterpret_cast<const char*>(&value), sizeof(value));
        if (buffer_.size() > 1 << 20) flush();
    }

private:
    void flush() {
        out_.write(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
        buffer_.clear();
    }
    std::ofstream out_;
    std::string buffer_;
};

std::array<float, 3> cross(const std::array<float, 3>& a, const std::array<float, 3>& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

std::array<float, 3> normalised(std::array<float, 3> v) {
    const float length = std::max(std::hypot(v[0], v[1], v[2]), 1e-20f);
    for (float& part : v) part /= length;
    return v;
}

std::array<float, 3> facetNormal(const Waves& mesh, std::size_t first) {
    std::array<std::array<float, 3>, 3> at{};
    for (std::size_t c = 0; c < 3; ++c)
        std::copy_n(&mesh.positions[std::size_t{3} * mesh.indices[first + c]], 3, at[c].begin());
    std::array<float, 3> one{}, other{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        one[axis] = at[1][axis] - at[0][axis];
        other[axis] = at[2][axis] - at[0][axis];
    }
    return normalised(cross(one, other));
}

}  // namespace

Waves waves(std::size_t triangles) {
    const auto side = static_cast<std::size_t>(std::sqrt(static_cast<double>(triangles) / 2));
    Waves mesh;
    mesh.positions.reserve(3 * (side + 1) * (side + 1));
    mesh.indices.reserve(6 * side * side);
    for (std::size_t row = 0; row <= side; ++row)
        for (std::size_t column = 0; column <= side; ++column) {
            const float u = static_cast<float>(column) / static_cast<float>(side),
                        v = static_cast<float>(row) / static_cast<float>(side);
            const float height = 0.05f * std::sin(40 * u) * std::cos(30 * v);
            const std::array<float, 3> normal = normalised(
                {-2.0f * std::cos(40 * u) * std::cos(30 * v), 1.5f * std::sin(40 * u) * std::sin(30 * v), 1});
            mesh.positions.insert(mesh.positions.end(), {u, v, height});
            mesh.normals.insert(mesh.normals.end(), normal.begin(), normal.end());
            mesh.texcoords.insert(mesh.texcoords.end(), {u, v});
        }
    for (std::size_t row = 0; row < side; ++row)
        for (std::size_t column = 0; column < side; ++column) {
            const auto a = static_cast<std::uint32_t>(row * (side + 1) + column), b = a + 1,
                       c = static_cast<std::uint32_t>(a + side + 1), d = c + 1;
            mesh.indices.insert(mesh.indices.end(), {a, b, d, a, d, c});
        }
    return mesh;
}

void writeObj(const std::string& path, const Waves& mesh, bool isWhole) {
    Output out(path);
    out.text("o waves\n");
    for (std::size_t at = 0; at < mesh.positions.size(); at += 3)
        out.text("v {:.6f} {:.6f} {:.6f}\n", mesh.positions[at], mesh.positions[at + 1], mesh.positions[at + 2]);
    for (std::size_t at = 0; isWhole && at < mesh.texcoords.size(); at += 2)
        out.text("vt {:.6f} {:.6f}\n", mesh.texcoords[at], mesh.texcoords[at + 1]);
    for (std::size_t at = 0; isWhole && at < mesh.normals.size(); at += 3)
        out.text("vn {:.4f} {:.4f} {:.4f}\n", mesh.normals[at], mesh.normals[at + 1], mesh.normals[at + 2]);
    for (std::size_t at = 0; at < mesh.indices.size(); at += 3) {
        const std::uint32_t a = mesh.indices[at] + 1, b = mesh.indices[at + 1] + 1, c = mesh.indices[at + 2] + 1;
        if (isWhole)
            out.text("f {0}/{0}/{0} {1}/{1}/{1} {2}/{2}/{2}\n", a, b, c);
        else
            out.text("f {} {} {}\n", a, b, c);
    }
}

namespace {

/// One file in a zip archive.
struct Packed {
    std::string name, bytes;
    std::size_t size = 0;
    std::uint32_t sum = 0;
};

Packed packed(std::string name, const std::string& content) {
    Packed part{.name = std::move(name), .size = content.size()};
    const auto* const letters = reinterpret_cast<const Bytef*>(content.data());
    part.sum = static_cast<std::uint32_t>(::crc32(0, letters, static_cast<uInt>(content.size())));
    z_stream stream{};
    if (::deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY) != Z_OK)
        std::abort();
    part.bytes.resize(::deflateBound(&stream, static_cast<uLong>(content.size())));
    stream.next_in = const_cast<Bytef*>(letters);
    stream.avail_in = static_cast<uInt>(content.size());
    stream.next_out = reinterpret_cast<Bytef*>(part.bytes.data());
    stream.avail_out = static_cast<uInt>(part.bytes.size());
    (void)::deflate(&stream, Z_FINISH);
    part.bytes.resize(stream.total_out);
    ::deflateEnd(&stream);
    return part;
}

}  // namespace

void writeThreeMf(const std::string& path, const Waves& mesh) {
    std::string model =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"meter\" "
        "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\"><resources><object id=\"1\" "
        "type=\"model\"><mesh><vertices>\n";
    for (std::size_t at = 0; at < mesh.positions.size(); at += 3)
        fmt::format_to(std::back_inserter(model), "<vertex x=\"{:.6f}\" y=\"{:.6f}\" z=\"{:.6f}\"/>\n",
                       mesh.positions[at], mesh.positions[at + 1], mesh.positions[at + 2]);
    model += "</vertices><triangles>\n";
    for (std::size_t at = 0; at < mesh.indices.size(); at += 3)
        fmt::format_to(std::back_inserter(model), "<triangle v1=\"{}\" v2=\"{}\" v3=\"{}\"/>\n", mesh.indices[at],
                       mesh.indices[at + 1], mesh.indices[at + 2]);
    model += "</triangles></mesh></object></resources><build><item objectid=\"1\"/></build></model>\n";
    const std::string relations =
        "<?xml version=\"1.0\"?><Relationships "
        "xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\"><Relationship Id=\"r0\" "
        "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\" "
        "Target=\"/3D/3dmodel.model\"/></Relationships>";
    Output out(path);
    std::string list;
    std::uint32_t at = 0;
    const std::array<Packed, 2> parts = {packed("_rels/.rels", relations), packed("3D/3dmodel.model", model)};
    // Heads of PKWARE's APPNOTE: signature, version, flags, method, time, sum, sizes, lengths of what follows.
    const auto head = [](const Packed& part, bool isOfList) {
        std::string bytes = isOfList ? std::string("PK\1\2\24\0\24\0\0\0\10\0\0\0\0\0", 16)
                                     : std::string("PK\3\4\24\0\0\0\10\0\0\0\0\0", 14);
        for (const std::size_t number : {std::size_t{part.sum}, part.bytes.size(), part.size, part.name.size()})
            for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<char>(number >> (8 * i)));
        return bytes;  // no extra field: the upper two bytes of the name's length
    };
    for (const Packed& part : parts) {
        const std::string own = head(part, false) + part.name + part.bytes;
        list += head(part, true) + std::string(10, '\0');
        for (int i = 0; i < 4; ++i) list.push_back(static_cast<char>(at >> (8 * i)));
        list += part.name;
        at += static_cast<std::uint32_t>(own.size());
        out.raw(own);
    }
    out.raw(list + std::string("PK\5\6\0\0\0\0\2\0\2\0", 12));
    out.value(static_cast<std::uint32_t>(list.size()));
    out.value(at);
    out.value(std::uint16_t{0});
}

void writeAmf(const std::string& path, const Waves& mesh) {
    Output out(path);
    out.text("<?xml version=\"1.0\"?>\n<amf unit=\"meter\"><object id=\"1\"><mesh><vertices>\n");
    for (std::size_t at = 0; at < mesh.positions.size(); at += 3)
        out.text("<vertex><coordinates><x>{:.6f}</x><y>{:.6f}</y><z>{:.6f}</z></coordinates></vertex>\n",
                 mesh.positions[at], mesh.positions[at + 1], mesh.positions[at + 2]);
    out.text("</vertices><volume>\n");
    for (std::size_t at = 0; at < mesh.indices.size(); at += 3)
        out.text("<triangle><v1>{}</v1><v2>{}</v2><v3>{}</v3></triangle>\n", mesh.indices[at], mesh.indices[at + 1],
                 mesh.indices[at + 2]);
    out.text("</volume></mesh></object></amf>\n");
}

void writePly(const std::string& path, const Waves& mesh, bool isText) {
    Output out(path);
    out.text(
        "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\n"
        "property list uchar int vertex_indices\nend_header\n",
        isText ? "ascii" : "binary_little_endian", mesh.positions.size() / 3, mesh.indices.size() / 3);
    for (std::size_t at = 0; at < mesh.positions.size(); at += 3)
        if (isText)
            out.text("{:.6f} {:.6f} {:.6f}\n", mesh.positions[at], mesh.positions[at + 1], mesh.positions[at + 2]);
        else
            for (std::size_t axis = 0; axis < 3; ++axis) out.value(mesh.positions[at + axis]);
    for (std::size_t at = 0; at < mesh.indices.size(); at += 3)
        if (isText) {
            out.text("3 {} {} {}\n", mesh.indices[at], mesh.indices[at + 1], mesh.indices[at + 2]);
        } else {
            out.value(std::uint8_t{3});
            for (std::size_t corner = 0; corner < 3; ++corner) out.value(mesh.indices[at + corner]);
        }
}

void writeStl(const std::string& path, const Waves& mesh, bool isText) {
    Output out(path);
    if (isText)
        out.text("solid waves\n");
    else
        out.text("{:<80}", "waves");
    if (!isText) out.value(static_cast<std::uint32_t>(mesh.indices.size() / 3));
    for (std::size_t at = 0; at < mesh.indices.size(); at += 3) {
        const std::array<float, 3> normal = facetNormal(mesh, at);
        if (isText)
            out.text("  facet normal {:e} {:e} {:e}\n    outer loop\n", normal[0], normal[1], normal[2]);
        else
            out.value(normal);
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const float* const place = &mesh.positions[std::size_t{3} * mesh.indices[at + corner]];
            if (isText)
                out.text("      vertex {:e} {:e} {:e}\n", place[0], place[1], place[2]);
            else
                for (std::size_t axis = 0; axis < 3; ++axis) out.value(place[axis]);
        }
        if (isText)
            out.text("    endloop\n  endfacet\n");
        else
            out.value(std::uint16_t{0});
    }
    if (isText) out.text("endsolid waves\n");
}

namespace {

/// A .glb under construction: a buffer, and the texts of its views and accessors.
struct Glb {
    std::string bytes;
    std::vector<std::string> views, accessors;
    std::size_t unpacked = 0;  ///< of the second buffer, which is nowhere

    std::size_t append(const void* data, std::size_t size) {
        const std::size_t at = bytes.size();
        bytes.append(static_cast<const char*>(data), size);
        bytes.resize((bytes.size() + 3) / 4 * 4, '\0');
        return at;
    }
    void plainView(const void* data, std::size_t size, std::size_t stride) {
        const std::size_t at = append(data, size);
        views.push_back(fmt::format(R"({{"buffer":0,"byteOffset":{},"byteLength":{}{}}})", at, size,
                                    stride == 0 ? "" : fmt::format(R"(,"byteStride":{})", stride)));
    }
    void meshoptView(const std::vector<unsigned char>& packed, std::size_t count, std::size_t stride,
                     const char* mode) {
        const std::size_t at = append(packed.data(), packed.size());
        const bool isOfIndices = std::string_view(mode) == "TRIANGLES";
        views.push_back(
            fmt::format(R"({{"buffer":1,"byteOffset":{},"byteLength":{}{},"extensions":{{"EXT_meshopt_compression":)"
                        R"({{"buffer":0,"byteOffset":{},"byteLength":{},"byteStride":{},"count":{},"mode":"{}"}}}}}})",
                        unpacked, count * stride, isOfIndices ? "" : fmt::format(R"(,"byteStride":{})", stride), at,
                        packed.size(), stride, count, mode));
        unpacked += count * stride;
    }
    void accessor(int view, int componentType, std::size_t count, const char* type, const std::string& more = "") {
        accessors.push_back(fmt::format(R"({{{}"componentType":{},"count":{},"type":"{}"{}}})",
                                        view < 0 ? "" : fmt::format(R"("bufferView":{},)", view), componentType, count,
                                        type, more));
    }
    void write(const std::string& path, const std::string& primitive, const std::string& extension) const {
        const std::string used =
            extension.empty() ? ""
                              : fmt::format(R"("extensionsUsed":["{0}"],"extensionsRequired":["{0}"],)", extension);
        const std::string second =
            unpacked == 0
                ? ""
                : fmt::format(R"(,{{"byteLength":{},"extensions":{{"EXT_meshopt_compression":{{"fallback":true}}}}}})",
                              unpacked);
        std::string json = fmt::format(
            R"({{"asset":{{"version":"2.0"}},{}"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],)"
            R"("meshes":[{{"primitives":[{{"attributes":{{"POSITION":1,"NORMAL":2,"TEXCOORD_0":3}},)"
            R"("indices":0{}}}]}}],)"
            R"("buffers":[{{"byteLength":{}}}{}],"bufferViews":[{}],"accessors":[{}]}})",
            used, primitive, bytes.size(), second, fmt::join(views, ","), fmt::join(accessors, ","));
        json.resize((json.size() + 3) / 4 * 4, ' ');
        Output out(path);
        const auto word = [&](std::size_t value) { out.value(static_cast<std::uint32_t>(value)); };
        out.text("glTF");
        word(2);
        word(28 + json.size() + bytes.size());
        word(json.size());
        out.text("JSON{}", json);
        word(bytes.size());
        out.value(std::array{'B', 'I', 'N', '\0'});
        out.text("{}", bytes);
    }
};

constexpr int kByte = 5120, kShort = 5122, kUnsignedShort = 5123, kUnsigned = 5125, kFloat = 5126;
constexpr const char* kBounds = R"(,"min":[0,0,-0.05],"max":[1,1,0.05])";

void addDraco(Glb& glb, const Waves& mesh) {
    draco::TriangleSoupMeshBuilder builder;
    const std::size_t triangles = mesh.indices.size() / 3;
    builder.Start(static_cast<int>(triangles));
    const int places = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32),
              normals = builder.AddAttribute(draco::GeometryAttribute::NORMAL, 3, draco::DT_FLOAT32),
              coordinates = builder.AddAttribute(draco::GeometryAttribute::TEX_COORD, 2, draco::DT_FLOAT32);
    for (std::size_t t = 0; t < triangles; ++t) {
        const std::uint32_t* const corner = &mesh.indices[3 * t];
        const auto set = [&](int attribute, const std::vector<float>& values, std::size_t each) {
            builder.SetAttributeValuesForFace(attribute, draco::FaceIndex(static_cast<std::uint32_t>(t)),
                                              &values[each * corner[0]], &values[each * corner[1]],
                                              &values[each * corner[2]]);
        };
        set(places, mesh.positions, 3);
        set(normals, mesh.normals, 3);
        set(coordinates, mesh.texcoords, 2);
    }
    const std::unique_ptr<draco::Mesh> built = builder.Finalize();
    draco::Encoder encoder;
    encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, 14);
    encoder.SetAttributeQuantization(draco::GeometryAttribute::NORMAL, 10);
    encoder.SetAttributeQuantization(draco::GeometryAttribute::TEX_COORD, 12);
    draco::EncoderBuffer packed;
    if (!encoder.EncodeMeshToBuffer(*built, &packed).ok()) std::abort();
    glb.plainView(packed.data(), packed.size(), 0);
}

template <typename Value>
std::vector<unsigned char> packedVertices(const std::vector<Value>& values, std::size_t each) {
    const std::size_t stride = each * sizeof(Value), count = values.size() / each;
    std::vector<unsigned char> packed(meshopt_encodeVertexBufferBound(count, stride));
    packed.resize(meshopt_encodeVertexBuffer(packed.data(), packed.size(), values.data(), count, stride));
    return packed;
}

void addMeshopt(Glb& glb, const Waves& mesh) {
    const std::size_t count = mesh.positions.size() / 3;
    std::vector<unsigned char> corners(meshopt_encodeIndexBufferBound(mesh.indices.size(), count));
    corners.resize(meshopt_encodeIndexBuffer(corners.data(), corners.size(), mesh.indices.data(), mesh.indices.size()));
    glb.meshoptView(corners, mesh.indices.size(), 4, "TRIANGLES");
    glb.meshoptView(packedVertices(mesh.positions, 3), count, 12, "ATTRIBUTES");
    glb.meshoptView(packedVertices(mesh.normals, 3), count, 12, "ATTRIBUTES");
    glb.meshoptView(packedVertices(mesh.texcoords, 2), count, 8, "ATTRIBUTES");
}

void addQuantised(Glb& glb, const Waves& mesh) {
    const std::size_t count = mesh.positions.size() / 3;
    std::vector<std::int16_t> places;
    std::vector<std::int8_t> normals;
    std::vector<std::uint16_t> coordinates;
    for (std::size_t v = 0; v < count; ++v) {
        for (std::size_t k = 0; k < 3; ++k) {
            places.push_back(static_cast<std::int16_t>(std::lround(mesh.positions[3 * v + k] * 32767)));
            normals.push_back(static_cast<std::int8_t>(std::lround(mesh.normals[3 * v + k] * 127)));
        }
        places.push_back(0);
        normals.push_back(0);
        for (std::size_t k = 0; k < 2; ++k)
            coordinates.push_back(static_cast<std::uint16_t>(std::lround(mesh.texcoords[2 * v + k] * 65535)));
    }
    glb.plainView(mesh.indices.data(), mesh.indices.size() * 4, 0);
    glb.plainView(places.data(), places.size() * 2, 8);
    glb.plainView(normals.data(), normals.size(), 4);
    glb.plainView(coordinates.data(), coordinates.size() * 2, 4);
}

}  // namespace

void writeGlb(const std::string& path, const Waves& mesh, GlbKind kind) {
    Glb glb;
    const std::size_t count = mesh.positions.size() / 3;
    const bool isDraco = kind == GlbKind::kDraco, isQuantised = kind == GlbKind::kQuantised;
    if (isDraco) addDraco(glb, mesh);
    if (kind == GlbKind::kMeshopt) addMeshopt(glb, mesh);
    if (isQuantised) addQuantised(glb, mesh);
    if (kind == GlbKind::kPlain) {
        glb.plainView(mesh.indices.data(), mesh.indices.size() * 4, 0);
        glb.plainView(mesh.positions.data(), mesh.positions.size() * 4, 0);
        glb.plainView(mesh.normals.data(), mesh.normals.size() * 4, 0);
        glb.plainView(mesh.texcoords.data(), mesh.texcoords.size() * 4, 0);
    }
    glb.accessor(isDraco ? -1 : 0, kUnsigned, mesh.indices.size(), "SCALAR");
    const std::string normalised = isQuantised ? R"(,"normalized":true)" : "";
    glb.accessor(isDraco ? -1 : 1, isQuantised ? kShort : kFloat, count, "VEC3", isQuantised ? normalised : kBounds);
    glb.accessor(isDraco ? -1 : 2, isQuantised ? kByte : kFloat, count, "VEC3", normalised);
    glb.accessor(isDraco ? -1 : 3, isQuantised ? kUnsignedShort : kFloat, count, "VEC2", normalised);
    glb.write(path,
              isDraco ? R"(,"extensions":{"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":0,)"
                        R"("NORMAL":1,"TEXCOORD_0":2}}})"
                      : "",
              isDraco                     ? "KHR_draco_mesh_compression"
              : kind == GlbKind::kMeshopt ? "EXT_meshopt_compression"
              : isQuantised               ? "KHR_mesh_quantization"
                                          : "");
}

}  // namespace tessera::bench
