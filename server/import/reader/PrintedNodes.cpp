#include "server/import/reader/PrintedNodes.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "common/confine/Confinement.h"
#include "common/math/Srgb.h"

namespace tessera {
namespace {

constexpr std::int64_t kNoneShown = -2;  // common/cores/Switch.h

}  // namespace

std::size_t mostPrintedResources(const ReadLimits& limits, std::size_t fileBytes, bool isArchive) {
    const std::size_t bytesOfEach = isArchive ? 64 : 512;
    return limits.freeNodes / 4 + fileBytes / bytesOfEach;
}

bool isRegular(const Affine3d& map) {
    constexpr double kShortest = 1e-12, kFlattest = 1e-9;
    const Vec3d lengths = map.linear().colwise().norm();
    return map.matrix().allFinite() && lengths.minCoeff() > kShortest &&
           std::abs(map.linear().determinant()) > kFlattest * lengths.prod();
}

PrintedObject& PrintedNodes::addObject(const std::string& name) {
    PrintedObject& object = objects_.emplace_back();
    object.name = foreignName(name, "object");
    return object;
}

void PrintedNodes::addMesh(PrintedObject& object, const std::string& name, MeshData mesh, const std::string& material) {
    const std::string made = fmt::format("mesh {}", meshes_++);
    object.meshes.push_back({name, made, material});
    scene_.addModelMesh(made, std::move(mesh), limits_);
}

std::string PrintedNodes::addMaterial(const PrintedMaterial& material) {
    const std::string wanted = foreignName(material.name, "material");
    std::string name = wanted;
    while (!materials_.try_emplace(name, 1).second) name = fmt::format("{} {}", wanted, ++materials_[wanted]);
    proto::scene::Material& message = *scene_.file.add_material();
    message.set_name(name);
    const auto channel = [&](int shift) { return static_cast<float>(material.color >> shift & 0xff) / 255; };
    proto::scene::Color& color = *message.mutable_base_color();
    color.set_r(linearOfSrgb(channel(24)));
    color.set_g(linearOfSrgb(channel(16)));
    color.set_b(linearOfSrgb(channel(8)));
    color.set_a(channel(0));
    if (!material.image.empty()) message.set_base_color_image(material.image);
    if (material.isTranslucent) message.set_alpha_mode(proto::scene::Material::BLEND);
    message.set_double_sided(material.hasTwoSides);
    return name;
}

proto::scene::Node& PrintedNodes::addRoot(const std::string& name, double unitMetres) {
    proto::scene::Node& root = *scene_.file.add_node();
    root.set_name(foreignName(name, "model"));
    setTransform(*root.mutable_transform(), Vec3d::Zero(), Quatd::Identity(), Vec3d::Constant(unitMetres));
    return root;
}

void PrintedNodes::dropPlacedElsewhere(std::vector<PrintedPlace>& places) {
    std::set<const PrintedObject*> seen;
    // Depth first, without recursion; what is done last is held by nothing, or by what it holds itself (Kosaraju).
    const auto follow = [&](const PrintedObject* from, auto&& done) {
        if (!seen.insert(from).second) return;
        for (std::vector<std::pair<const PrintedObject*, std::size_t>> open = {{from, 0}}; !open.empty();) {
            auto& [object, next] = open.back();
            if (next == object->places.size()) {
                done(object);
                open.pop_back();
            } else if (const PrintedObject* const below = object->places[next++].object; seen.insert(below).second) {
                open.push_back({below, 0});
            }
        }
    };
    std::vector<const PrintedObject*> order;
    for (const PrintedPlace& place : places) follow(place.object, [&](const auto* object) { order.push_back(object); });
    std::ranges::reverse(order);
    seen.clear();
    std::set<const PrintedObject*> first;
    for (const PrintedObject* const object : order) {
        if (!seen.contains(object)) first.insert(object);
        follow(object, [](const auto*) {});
    }
    std::erase_if(places, [&](const PrintedPlace& place) { return !first.contains(place.object); });
}

std::vector<PrintedObject*> PrintedNodes::orderFrom(PrintedObject& object) {
    using State = PrintedObject::State;
    struct Open {
        PrintedObject* object;
        std::size_t next = 0;
    };
    std::vector<PrintedObject*> order;
    if (object.state != State::kNew) return order;
    object.state = State::kOpen;
    // No recursion: a file may nest as deeply as it likes.
    for (std::vector<Open> open = {{&object}}; !open.empty();) {
        auto& [current, next] = open.back();
        if (next == current->places.size()) {
            current->state = State::kCounted;
            current->nodes =
                static_cast<double>(current->isMeshAlone() ? 0 : current->meshes.size()) + current->isHidden;
            for (const PrintedPlace& place : current->places) {
                current->nodes += 1 + place.object->nodes;
                current->depth = std::max(current->depth, place.object->depth);
            }
            current->depth += current->isMeshAlone() ? 0 : 1 + std::size_t{current->isHidden};
            order.push_back(current);
            open.pop_back();
            continue;
        }
        PrintedObject* const below = current->places[next].object;
        if (below->state == State::kOpen) {
            scene_.noteMissing(
                fmt::format("'{}' holds itself, by way of '{}': it is left out there", below->name, current->name));
            current->places.erase(current->places.begin() + static_cast<std::ptrdiff_t>(next));
            continue;
        }
        ++next;
        if (below->state != State::kNew) continue;
        below->state = State::kOpen;
        open.push_back({below});
    }
    return order;
}

void PrintedNodes::write(const std::vector<PrintedPlace>& places, const std::function<proto::scene::Node*()>& make) {
    for (const PrintedPlace& place : places) {
        proto::scene::Node* const node = addPlacedNode(make, place.name, place.map);
        if (place.object->isMeshAlone()) {
            node->mutable_geometry()->set_mesh(place.object->meshes[0].mesh);
            node->mutable_geometry()->set_material(place.object->meshes[0].material);
        } else if (!place.object->definition.empty()) {
            node->set_instance(place.object->definition);
        }
    }
}

void PrintedNodes::write(PrintedObject& object) {
    if (object.isMeshAlone() || object.isEmpty()) return;
    object.definition = fmt::format("object {}", definitions_++);
    proto::scene::Definition& definition = *scene_.file.add_definition();
    definition.set_name(object.definition);
    std::function<proto::scene::Node*()> make = [&] { return definition.add_node(); };
    if (object.isHidden) {
        proto::scene::Node* const hidden = make();
        hidden->set_name("hidden");
        hidden->mutable_switch_()->set_choice(kNoneShown);
        make = [hidden] { return hidden->add_node(); };
    }
    for (const PrintedObject::Mesh& mesh : object.meshes) {
        proto::scene::Node* const node = make();
        node->set_name(mesh.name);
        node->mutable_geometry()->set_mesh(mesh.mesh);
        node->mutable_geometry()->set_material(mesh.material);
    }
    write(object.places, make);
}

Expected<void> PrintedNodes::place(const std::vector<PrintedPlace>& places, proto::scene::Node& parent) {
    std::vector<PrintedObject*> order;
    double nodes = 1;
    std::size_t depth = 0;
    for (const PrintedPlace& place : places) {
        const std::vector<PrintedObject*> more = orderFrom(*place.object);
        order.insert(order.end(), more.begin(), more.end());
        nodes += 1 + place.object->nodes;
        depth = std::max(depth, place.object->depth);
    }
    constexpr std::size_t kAbove = 4;  // the file's node, the root, the place, and one of a sheared place
    if (depth + kAbove > limits_.maxDepth)
        return fail(
            ErrorCode::kLimit,
            fmt::format("its objects hold others {} levels deep, more than the {} that a scene may have: save it "
                        "with its parts joined",
                        depth, limits_.maxDepth - std::min(kAbove, limits_.maxDepth)));
    if (const std::size_t most = limits_.nodesOf(bytesGranted()); nodes > static_cast<double>(most))
        return fail(ErrorCode::kLimit,
                    fmt::format("its objects hold others so often that there would be {:.3g} nodes, more than {}: save "
                                "fewer copies, or their parts joined, or give it more by --import-memory",
                                nodes, most));
    for (PrintedObject* const object : order) write(*object);
    write(places, [&] { return parent.add_node(); });
    return {};
}

}  // namespace tessera
