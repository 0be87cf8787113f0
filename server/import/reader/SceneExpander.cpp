#include "server/import/reader/SceneExpander.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/unknown_field_set.h>
#include <algorithm>
#include <filesystem>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/base/Nearest.h"
#include "common/scenefile/SceneSchema.h"
#include "server/import/reader/ImageDecoder.h"
#include "server/import/reader/NurbsMessage.h"
#include "server/import/reader/SceneShapes.h"
#include "server/import/reader/VolumeNode.h"

namespace tessera {
namespace {

using Content = proto::scene::Node::ContentCase;
using google::protobuf::FieldDescriptor;

const FieldDescriptor* fieldOf(const google::protobuf::Message& message, int number) {
    return message.GetDescriptor()->FindFieldByNumber(number);
}

std::optional<RunKind> runKindOf(proto::scene::Mesh::Primitive primitive) {
    using Mesh = proto::scene::Mesh;
    switch (primitive) {
        case Mesh::LINE_STRIPS:
            return RunKind::kLineStrips;
        case Mesh::LINE_LOOPS:
            return RunKind::kLineLoops;
        case Mesh::TRIANGLE_STRIPS:
            return RunKind::kTriangleStrips;
        case Mesh::TRIANGLE_FANS:
            return RunKind::kTriangleFans;
        case Mesh::QUADS:
            return RunKind::kQuads;
        case Mesh::QUAD_STRIPS:
            return RunKind::kQuadStrips;
        case Mesh::POLYGONS:
            return RunKind::kPolygons;
        default:
            return std::nullopt;
    }
}

Bytes numberBytes(std::span<const std::uint32_t> numbers) {
    const ByteSpan bytes = std::as_bytes(numbers);
    return {bytes.begin(), bytes.end()};
}

}  // namespace

tl::unexpected<Error> SceneExpander::failAt(const proto::scene::Place& place, const Error& error) {
    if (place.line() == 0) return tl::unexpected<Error>(error);
    return fail(error.code, fmt::format("{}:{}: {}", place.line(), place.column(), error.message));
}

proto::scene::Place SceneExpander::Where::place() const {
    proto::scene::Place place;
    if (around == nullptr || field == nullptr) return place;
    const auto location = around->GetLocation(SceneSchema::get().twin(field), index);
    place.set_line(static_cast<std::uint32_t>(location.line + 1));
    place.set_column(static_cast<std::uint32_t>(location.column + 1));
    return place;
}

const SceneExpander::Places* SceneExpander::Where::inside() const {
    return around == nullptr || field == nullptr ? nullptr
                                                 : around->GetTreeForNested(SceneSchema::get().twin(field), index);
}

Expected<void> SceneExpander::checkName(const std::set<std::string>& names, const std::string& name,
                                        const char* what) const {
    if (names.count(name) > 0) return {};
    const std::string nearest = nearestName(name, std::vector<std::string>(names.begin(), names.end()));
    return fail(ErrorCode::kBadInput, fmt::format("there is no {} '{}'{}", what, name,
                                                  nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest)));
}

void SceneExpander::nameLater(proto::scene::SceneFile& file) {
    std::map<std::string, std::size_t> found;
    std::vector<google::protobuf::Message*> open = {&file};
    std::vector<const FieldDescriptor*> present;
    while (!open.empty()) {
        google::protobuf::Message& message = *open.back();
        open.pop_back();
        const google::protobuf::Reflection& reflection = *message.GetReflection();
        const std::string& type = message.GetDescriptor()->name();
        const google::protobuf::UnknownFieldSet& unknown = reflection.GetUnknownFields(message);
        for (int i = 0; i < unknown.field_count(); ++i)
            ++found[fmt::format("field {} of {}", unknown.field(i).number(), type)];
        present.clear();
        reflection.ListFields(message, &present);
        for (const FieldDescriptor* field : present) {
            if (field->message_type() != nullptr && field->is_repeated()) {
                for (int i = 0; i < reflection.FieldSize(message, field); ++i)
                    open.push_back(reflection.MutableRepeatedMessage(&message, field, i));
            } else if (field->message_type() != nullptr) {
                open.push_back(reflection.MutableMessage(&message, field));
            } else if (field->enum_type() != nullptr) {
                const int word = reflection.GetEnumValue(message, field);
                if (field->enum_type()->FindValueByNumber(word) != nullptr) continue;
                ++found[fmt::format("{} {} of {}", field->name(), word, type)];
                reflection.ClearField(&message, field);
            }
        }
    }
    for (const auto& [what, times] : found)
        scene_.note(fmt::format("a newer version of Tessera wrote {}{}: not understood, left out", what,
                                times > 1 ? fmt::format(" ({} times)", times) : ""));
}

template <typename Items>
Expected<void> SceneExpander::collectNames(const Items& items, const Places* places, const char* field,
                                           std::set<std::string>& names) {
    const FieldDescriptor* descriptor = proto::scene::SceneFile::descriptor()->FindFieldByName(field);
    for (int i = 0; i < items.size(); ++i) {
        const proto::scene::Place at = Where{places, descriptor, i}.place();
        const std::string& name = items.Get(i).name();
        if (name.empty()) return failAt(at, {ErrorCode::kBadInput, fmt::format("this {} has no name", field)});
        if (!names.insert(name).second)
            return failAt(at, {ErrorCode::kBadInput, fmt::format("the {} '{}' is there twice", field, name)});
    }
    return {};
}

Expected<PlainScene> SceneExpander::expand(proto::scene::SceneFile file, const Places* places) {
    if (file.version() > 1)
        return fail(ErrorCode::kBadInput,
                    fmt::format("it is a scene of version {}; this program reads version 1", file.version()));
    if (Expected<void> done = collectNames(file.material(), places, "material", materials_); !done)
        return tl::unexpected(done.error());
    if (Expected<void> done = collectNames(file.image(), places, "image", images_); !done)
        return tl::unexpected(done.error());
    if (Expected<void> done = collectNames(file.mesh(), places, "mesh", meshes_); !done)
        return tl::unexpected(done.error());
    if (Expected<void> done = collectNames(file.definition(), places, "definition", definitions_); !done)
        return tl::unexpected(done.error());

    const google::protobuf::Descriptor* type = file.GetDescriptor();
    const auto where = [&](const char* field, int index) { return Where{places, type->FindFieldByName(field), index}; };
    // As it is: whoever knows the scene reads it. What a newer version wrote goes along.
    scene_.file.set_saved(std::move(*file.mutable_saved()));
    scene_.file.GetReflection()
        ->MutableUnknownFields(&scene_.file)
        ->Swap(file.GetReflection()->MutableUnknownFields(&file));
    if (places == nullptr) nameLater(file);  // in a text such a number is a slip of the hand, and refused as one
    // The blobs keep their numbers; meshes and images made here get later ones.
    for (std::string& blob : *file.mutable_blob()) {
        const ByteSpan bytes = asBytes(blob);
        scene_.blobs.emplace_back(bytes.begin(), bytes.end());
        blob = std::string();
    }
    for (int i = 0; i < file.material_size(); ++i) {
        if (Expected<void> known = checkNames(file.material(i)); !known)
            return failAt(where("material", i).place(), known.error());
        proto::scene::Material* material = scene_.file.add_material();
        *material = file.material(i);
        tellPlaces(where("material", i), *material);
    }
    collectFilms(file);
    for (int i = 0; i < file.image_size(); ++i)
        if (Expected<void> done = expandImage(file.image(i), where("image", i).place()); !done)
            return failAt(where("image", i).place(), done.error());
    pictures_.finish();
    if (!lost_.empty()) forgetLost();
    for (int i = 0; i < file.mesh_size(); ++i)
        if (Expected<void> done = expandMesh(file.mesh(i)); !done)
            return failAt(where("mesh", i).place(), done.error());
    for (int i = 0; i < file.definition_size(); ++i) {
        const proto::scene::Definition& definition = file.definition(i);
        proto::scene::Definition* out = scene_.file.add_definition();
        out->set_name(definition.name());
        const Places* inside = where("definition", i).inside();
        for (int n = 0; n < definition.node_size(); ++n)
            if (Expected<void> done =
                    expandNode(definition.node(n), Where{inside, fieldOf(definition, 2), n}, {}, *out->mutable_node());
                !done)
                return tl::unexpected(done.error());
    }
    for (int i = 0; i < file.node_size(); ++i)
        if (Expected<void> done = expandNode(file.node(i), where("node", i), {}, *scene_.file.mutable_node()); !done)
            return tl::unexpected(done.error());
    return std::move(scene_);
}

void SceneExpander::tellPlaces(const Where& where, proto::scene::Material& material) {
    material.clear_at();
    const auto tell = [&](int number, const proto::scene::Place& at) {
        if (at.line() == 0) return;
        proto::scene::FieldPlace& told = *material.add_at();
        told.set_field(static_cast<std::uint32_t>(number));
        told.set_at(std::uint64_t{at.line()} << 32 | at.column());
    };
    tell(0, where.place());
    const google::protobuf::Descriptor& type = *material.GetDescriptor();
    for (int i = 0; where.around != nullptr && i < type.field_count(); ++i)
        if (const FieldDescriptor* field = type.field(i);
            !field->is_repeated() && material.GetReflection()->HasField(material, field))
            tell(field->number(), Where{where.inside(), field, -1}.place());
}

Expected<void> SceneExpander::checkNames(const proto::scene::Material& material) const {
    const google::protobuf::Descriptor& type = *material.GetDescriptor();
    for (int i = 0; i < type.field_count(); ++i) {
        const FieldDescriptor& field = *type.field(i);
        if (field.number() == proto::scene::Material::kNameFieldNumber ||
            field.cpp_type() != FieldDescriptor::CPPTYPE_STRING)
            continue;
        if (field.is_repeated() || !field.name().ends_with("_image")) continue;
        const std::string image = material.GetReflection()->GetString(material, &field);
        if (image.empty()) continue;
        if (Expected<void> known = checkName(images_, image, "image"); !known) return known;
    }
    for (const std::string& pass : material.pass())
        if (Expected<void> known = checkName(materials_, pass, "material"); !known) return known;
    if (!material.coarser().empty())
        if (Expected<void> known = checkName(materials_, material.coarser(), "material"); !known) return known;
    for (const proto::scene::Uniform& uniform : material.uniform())
        if (Expected<void> known =
                uniform.image().empty() ? Expected<void>() : checkName(images_, uniform.image(), "image");
            !known)
            return known;
    for (const proto::scene::TextureLayer& layer : material.layer())
        if (!layer.image().empty())
            if (Expected<void> known = checkName(images_, layer.image(), "image"); !known) return known;
    return {};
}

Expected<void> SceneExpander::expandNode(const proto::scene::Node& node, const Where& where, const Context& context,
                                         google::protobuf::RepeatedPtrField<proto::scene::Node>& out) {
    if (context.depth > limits_.maxDepth)
        return failAt(where.place(),
                      {ErrorCode::kLimit, fmt::format("nodes are nested deeper than {} levels", limits_.maxDepth)});
    const Places* places = where.inside();
    Context below{node.material().empty() ? context.material : node.material(), context.depth + 1};
    if (!node.material().empty())
        if (Expected<void> known = checkName(materials_, node.material(), "material"); !known)
            return failAt(Where{places, fieldOf(node, proto::scene::Node::kMaterialFieldNumber), -1}.place(),
                          known.error());

    const proto::scene::Place at = where.place();
    const std::uint32_t count = node.has_repeat() ? node.repeat().count() : 1;
    for (std::uint32_t i = 0; i < count; ++i) {
        if (++nodes_ > limits_.maxNodes)
            return failAt(where.place(),
                          {ErrorCode::kLimit, fmt::format("the scene has more than {} nodes", limits_.maxNodes)});
        proto::scene::Node* copy = out.Add();
        copy->set_name(node.name());
        if (at.line() > 0) copy->set_at(std::uint64_t{at.line()} << 32 | at.column());
        if (node.has_transform()) *copy->mutable_transform() = node.transform();
        if (i > 0) {
            proto::scene::Vector* translation = copy->mutable_transform()->mutable_translation();
            translation->set_x(translation->x() + i * node.repeat().step().x());
            translation->set_y(translation->y() + i * node.repeat().step().y());
            translation->set_z(translation->z() + i * node.repeat().step().z());
        }
        if (Expected<void> done = expandContent(node, places, below.material, *copy); !done)
            return failAt(where.place(), done.error());
        if (node.has_lattice()) {
            if (!copy->has_geometry())
                return failAt(where.place(), {ErrorCode::kBadInput,
                                              "a lattice bends the shape or geometry of its node, and this one has "
                                              "none (surfaces have control points of their own)"});
            *copy->mutable_lattice() = node.lattice();
        }
        for (int n = 0; n < node.node_size(); ++n) {
            const Where child{places, fieldOf(node, proto::scene::Node::kNodeFieldNumber), n};
            if (Expected<void> done = expandNode(node.node(n), child, below, *copy->mutable_node()); !done) return done;
        }
    }
    return {};
}

Expected<void> SceneExpander::expandContent(const proto::scene::Node& node, const Places* places,
                                            const std::string& material, proto::scene::Node& out) {
    const Content content = node.content_case();
    const proto::scene::Place at = Where{places, fieldOf(node, static_cast<int>(content)), -1}.place();
    if (isShape(content)) {
        Expected<std::string> mesh = shapeMesh(node);
        if (!mesh) return tl::unexpected(mesh.error());
        out.mutable_geometry()->set_mesh(std::move(*mesh));
        out.mutable_geometry()->set_material(material);
        return {};
    }
    switch (content) {
        case Content::CONTENT_NOT_SET:
            return {};
        case Content::kGeometry: {
            *out.mutable_geometry() = node.geometry();
            if (Expected<void> known = checkName(meshes_, node.geometry().mesh(), "mesh"); !known) return known;
            if (node.geometry().material().empty()) out.mutable_geometry()->set_material(material);
            return out.geometry().material().empty() ? Expected<void>()
                                                     : checkName(materials_, out.geometry().material(), "material");
        }
        case Content::kSubdivisionSurface: {
            *out.mutable_subdivision_surface() = node.subdivision_surface();
            std::string& own = *out.mutable_subdivision_surface()->mutable_material();
            if (own.empty()) own = material;
            return own.empty() ? Expected<void>() : checkName(materials_, own, "material");
        }
        case Content::kNurbsSurface: {
            Expected<proto::scene::NurbsSurface> surface = byControlPoints(node.nurbs_surface());
            if (!surface) return tl::unexpected(surface.error());
            *out.mutable_nurbs_surface() = std::move(*surface);
            if (node.nurbs_surface().material().empty()) out.mutable_nurbs_surface()->set_material(material);
            return out.nurbs_surface().material().empty()
                       ? Expected<void>()
                       : checkName(materials_, out.nurbs_surface().material(), "material");
        }
        case Content::kText:
            *out.mutable_text() = node.text();
            if (node.text().material().empty()) out.mutable_text()->set_material(material);
            return out.text().material().empty() ? Expected<void>()
                                                 : checkName(materials_, out.text().material(), "material");
        case Content::kParticles:
            *out.mutable_particles() = node.particles();
            if (node.particles().material().empty()) out.mutable_particles()->set_material(material);
            return out.particles().material().empty() ? Expected<void>()
                                                      : checkName(materials_, out.particles().material(), "material");
        case Content::kGlyphs:
            *out.mutable_glyphs() = node.glyphs();
            if (node.glyphs().material().empty()) out.mutable_glyphs()->set_material(material);
            return out.glyphs().material().empty() ? Expected<void>()
                                                   : checkName(materials_, out.glyphs().material(), "material");
        case Content::kVolume: {
            const Expected<proto::scene::Volume> plain = plainVolume(files_, node.volume(), scene_);
            if (!plain) return tl::unexpected(plain.error());
            *out.mutable_volume() = *plain;
            if (plain->material().empty()) out.mutable_volume()->set_material(material);
            return out.volume().material().empty() ? Expected<void>()
                                                   : checkName(materials_, out.volume().material(), "material");
        }
        case Content::kInstance:
            out.set_instance(node.instance());
            out.set_material(material);  // of what the definition leaves open
            return checkName(definitions_, node.instance(), "definition");
        case Content::kImport:
            *out.mutable_import() = node.import();
            *out.mutable_import()->mutable_at() = at;
            out.set_material(node.material());
            return {};
        case Content::kMotion:
            *out.mutable_motion() = node.motion();
            *out.mutable_motion()->mutable_at() = at;
            return {};
        case Content::kAnimation:
            *out.mutable_animation() = node.animation();
            *out.mutable_animation()->mutable_at() = at;
            for (const proto::scene::Channel& channel : node.animation().channel()) {
                if (channel.material().empty()) continue;
                if (Expected<void> known = checkName(materials_, channel.material(), "material"); !known) return known;
            }
            return {};
        case Content::kSkin:
            *out.mutable_skin() = node.skin();
            *out.mutable_skin()->mutable_at() = at;
            if (node.skin().material().empty()) out.mutable_skin()->set_material(material);
            if (Expected<void> known = checkName(meshes_, node.skin().mesh(), "mesh"); !known) return known;
            return out.skin().material().empty() ? Expected<void>()
                                                 : checkName(materials_, out.skin().material(), "material");
        case Content::kCore:
            out.set_core(node.core());
            out.set_material(material);
            return material.empty() ? Expected<void>() : checkName(materials_, material, "material");
        case Content::kInterest:
            *out.mutable_interest() = node.interest();
            *out.mutable_interest()->mutable_at() = at;
            return {};
        case Content::kCollisionObject:
            *out.mutable_collision_object() = node.collision_object();
            *out.mutable_collision_object()->mutable_at() = at;
            return {};
        default: {
            // Lights, camera, switch, environment: as they are.
            const FieldDescriptor* field = fieldOf(node, static_cast<int>(content));
            out.GetReflection()->MutableMessage(&out, field)->CopyFrom(node.GetReflection()->GetMessage(node, field));
            if (!out.has_environment()) return {};
            if (lost_.contains(out.environment().image())) {
                out.mutable_environment()->clear_image();
            } else if (const std::string why = notAround(out.environment().image()); !why.empty()) {
                addFault(at, fmt::format("the surroundings' image '{}' cannot be had: {}; they are shown without",
                                         out.environment().image(), why));
                out.mutable_environment()->clear_image();
            }
            return {};
        }
    }
}

Expected<std::string> SceneExpander::shapeMesh(const proto::scene::Node& node) {
    std::string& name = shapes_[shapeKey(node)];
    if (!name.empty()) return name;
    Expected<MeshData> mesh = makeShape(node);
    if (!mesh) return tl::unexpected(mesh.error());
    name = fmt::format("shape {}", shapes_.size());
    while (meshes_.count(name) > 0) name += "'";  // a name that the file uses itself
    scene_.addMesh(name, std::move(*mesh));
    return name;
}

Expected<void> SceneExpander::expandMesh(const proto::scene::Mesh& mesh) {
    if (mesh.positions_blob() != 0) {
        proto::scene::Mesh* copy = scene_.file.add_mesh();
        *copy = mesh;
        copy->clear_position();
        copy->clear_normal();
        copy->clear_texcoord();
        copy->clear_texcoord1();
        copy->clear_color();
        copy->clear_tangent();
        copy->clear_index();
        copy->clear_length();
        return {};
    }
    MeshData data;
    data.positions.assign(mesh.position().begin(), mesh.position().end());
    data.normals.assign(mesh.normal().begin(), mesh.normal().end());
    data.texcoords.assign(mesh.texcoord().begin(), mesh.texcoord().end());
    data.texcoords1.assign(mesh.texcoord1().begin(), mesh.texcoord1().end());
    data.tangents.assign(mesh.tangent().begin(), mesh.tangent().end());
    data.indices.assign(mesh.index().begin(), mesh.index().end());
    const std::size_t vertices = data.positions.size() / 3;
    if (data.positions.empty() || data.positions.size() % 3 != 0)
        return fail(ErrorCode::kBadInput,
                    fmt::format("mesh '{}': position needs three numbers per vertex", mesh.name()));
    // Without an index the vertices as they stand.
    const std::size_t corners = mesh.primitive() == proto::scene::Mesh::TRIANGLES ? 3
                                : mesh.primitive() == proto::scene::Mesh::LINES   ? 2
                                                                                  : 0;
    if (corners > 0 && data.indices.empty()) {
        if (vertices % corners != 0)
            return fail(ErrorCode::kBadInput,
                        fmt::format("mesh '{}': without an index {} vertices are no whole number of {}", mesh.name(),
                                    vertices, corners == 3 ? "triangles" : "lines"));
        data.indices.resize(vertices);
        std::iota(data.indices.begin(), data.indices.end(), 0u);
    }
    if (mesh.primitive() == proto::scene::Mesh::POINTS) {
        data.primitive = Primitive::kPoints;
        data.pointRadius = mesh.point_radius();
        if (!data.indices.empty())
            return fail(ErrorCode::kBadInput, fmt::format("mesh '{}': points have no index", mesh.name()));
        if (!(data.pointRadius >= 0))
            return fail(ErrorCode::kBadInput, fmt::format("mesh '{}': point_radius must not be negative", mesh.name()));
    } else if (mesh.primitive() == proto::scene::Mesh::LINES) {
        data.primitive = Primitive::kLines;
        if (mesh.line_width() != 0) data.lineWidth = mesh.line_width();
        if (data.indices.size() % 2 != 0)
            return fail(ErrorCode::kBadInput, fmt::format("mesh '{}': index needs two numbers per line", mesh.name()));
    } else if (mesh.primitive() == proto::scene::Mesh::TRIANGLES && data.indices.size() % 3 != 0)
        return fail(ErrorCode::kBadInput,
                    fmt::format("mesh '{}': index needs three numbers per triangle", mesh.name()));
    for (const std::uint32_t index : data.indices)
        if (index >= vertices)
            return fail(ErrorCode::kBadInput,
                        fmt::format("mesh '{}': index {} of {} vertices", mesh.name(), index, vertices));
    if ((!data.normals.empty() && data.normals.size() != vertices * 3) ||
        (!data.texcoords.empty() && data.texcoords.size() != vertices * 2) ||
        (!data.texcoords1.empty() && data.texcoords1.size() != vertices * 2) ||
        (!data.tangents.empty() && data.tangents.size() != vertices * 4) ||
        (mesh.color_size() != 0 && static_cast<std::size_t>(mesh.color_size()) != vertices))
        return fail(ErrorCode::kBadInput,
                    fmt::format("mesh '{}': normal, tangent, texcoord, texcoord1 or color do not match its {} vertices",
                                mesh.name(), vertices));
    if (data.primitive == Primitive::kLines) data.lines = std::exchange(data.indices, {});
    for (const std::uint32_t color : mesh.color())
        for (int shift = 24; shift >= 0; shift -= 8) data.colors.push_back(static_cast<std::uint8_t>(color >> shift));
    if (const std::optional<RunKind> runs = runKindOf(mesh.primitive()))
        return expandRuns(mesh, *runs, std::move(data));
    scene_.addMesh(mesh.name(), std::move(data));
    return {};
}

/// They travel as they are written; what they are made into here is for the normals.
Expected<void> SceneExpander::expandRuns(const proto::scene::Mesh& mesh, RunKind kind, MeshData data) {
    const std::vector<std::uint32_t> written = std::exchange(data.indices, {}),
                                     lengths(mesh.length().begin(), mesh.length().end());
    const PrimitiveRuns runs{.kind = kind, .positions = data.positions, .indices = written, .lengths = lengths};
    if (Expected<void> sound = checkRuns(runs); !sound)
        return failWith(fmt::format("mesh '{}'", mesh.name()), sound.error());
    if (areLines(kind)) {
        data.primitive = Primitive::kLines;
        if (mesh.line_width() != 0) data.lineWidth = mesh.line_width();
    } else if (data.normals.empty()) {
        Expected<std::vector<std::uint32_t>> triangles = assembleRuns(runs);
        if (!triangles) return failWith(fmt::format("mesh '{}'", mesh.name()), triangles.error());
        data.indices = std::move(*triangles);
        computeNormals(data);
        data.tangents.clear();  // of other normals
        data.indices.clear();
    }
    proto::scene::Mesh& plain = scene_.addMesh(mesh.name(), std::move(data));
    plain.set_primitive(mesh.primitive());
    plain.set_indices_blob(scene_.addBlob(numberBytes(written)));
    plain.set_lengths_blob(scene_.addBlob(numberBytes(lengths)));
    return {};
}

}  // namespace tessera
