// Blocks of DXF, where they are placed, and the nodes that all of it becomes.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/import/reader/DxfReader.h"

namespace tessera {
namespace {

constexpr std::size_t kDeepest = 40;
constexpr std::int64_t kShowNone = -2;  // common/cores/Switch.h

double factorOf(const DxfRecord& record, int code) {
    const double factor = record.number(code, 1);
    return factor == 0 ? 1 : factor;
}

bool isMeshAlone(const proto::scene::Definition& definition) {
    return definition.node_size() == 1 && definition.node(0).has_geometry() && !definition.node(0).has_transform() &&
           definition.node(0).node_size() == 0;
}

}  // namespace

bool DxfReader::takeRoomFor(std::size_t places, std::size_t nodesOfEach) {
    const std::size_t room = mostNodes_ - std::min(placedNodes_, mostNodes_);
    const bool fits = places <= room && nodesOfEach < mostNodes_ && places * (nodesOfEach + 1) <= room;
    if (!fits) {
        leftOut(fmt::format("places of blocks and letters beyond {} nodes (--import-memory: more)", mostNodes_));
        return false;
    }
    placedNodes_ += places * (nodesOfEach + 1);
    return true;
}

bool DxfReader::takeRoomFor(std::size_t places, const DxfGuise& guise, DxfContent& to) {
    // As many letters as nodes: of a small file twenty million triangles or so, which hosts draw each. What stands in a
    // block counts where that one is placed.
    const bool counts = open_.empty();
    const std::size_t room = mostNodes_ - std::min(placedLetters_, mostNodes_);
    if (counts && guise.letters > 0 && places > room / guise.letters) {
        leftOut(fmt::format("places of blocks with more than {} letters together (--import-memory: more)", mostNodes_));
        return false;
    }
    if (!takeRoomFor(places, guise.nodes)) return false;
    if (counts) placedLetters_ += places * guise.letters;
    to.placedNodes += places * (guise.nodes + 1);
    to.letters += places * guise.letters;
    return true;
}

/// A row of a table by its name and a place: what dimensions and tables look like was drawn into a block.
Expected<void> DxfReader::addBlock(const DxfRecord& record, Reading& to) {
    const DxfBlock* const block = document_.block(record.word(2));
    if (!block) {
        leftOut(fmt::format("{} without a block that shows it", record.type == "ACAD_TABLE" ? "tables" : "dimensions"));
        return {};
    }
    const DxfLayer& layer = layerOf(record, to);
    const Expected<const DxfGuise*> guise = this->guise(*block, {&layer, colorOf(record, layer, to)});
    if (!guise) return tl::unexpected(guise.error());
    if (!*guise || !takeRoomFor(1, **guise, to.content)) return {};
    Affine3d place = Affine3d::Identity();
    if (record.type == "ACAD_TABLE") place.translation() = record.point(10);
    if (!(place.matrix().cwiseAbs().maxCoeff() < 1e12)) return {};
    to.content.of(layer).placed.push_back(
        {record.type == "ACAD_TABLE" ? "table" : "dimension", *guise, place * Eigen::Translation3d(-block->base)});
    return {};
}

Expected<void> DxfReader::addInsert(const DxfRecord& record, Reading& to) {
    const DxfBlock* const block = document_.block(record.word(2));
    const DxfLayer& layer = layerOf(record, to);
    const DxfColor color = colorOf(record, layer, to);
    const std::int64_t columns = std::clamp<std::int64_t>(record.integer(70, 1), 1, 0xffff),
                       rows = std::clamp<std::int64_t>(record.integer(71, 1), 1, 0xffff);
    const Affine3d first = Affine3d(dxfFrame(record.point(210, Vec3d::UnitZ()))) *
                           Eigen::Translation3d(record.point(10)) *
                           Eigen::AngleAxisd(record.number(50, 0) * std::numbers::pi / 180, Vec3d::UnitZ());
    const Vec3d scale(factorOf(record, 41), factorOf(record, 42), factorOf(record, 43));
    const Vec3d step(record.number(44, 0), record.number(45, 0), 0);
    const bool hasAttributes = record.integer(66, 0) == 1;
    if (!block) {
        leftOut("inserts of blocks that are not in the file");
    } else if (block->external) {
        leftOut("drawings in other files (external references)");
    } else {
        Expected<const DxfGuise*> guise = this->guise(*block, {&layer, color});
        if (!guise) return tl::unexpected(guise.error());
        const auto count = static_cast<std::size_t>(columns * rows);
        const bool sound = first.matrix().cwiseAbs().maxCoeff() < 1e12 && scale.cwiseAbs().maxCoeff() < 1e12 &&
                           step.cwiseAbs().maxCoeff() < 1e12 && block->base.cwiseAbs().maxCoeff() < 1e12;
        if (*guise && sound && takeRoomFor(count, **guise, to.content)) {
            std::vector<DxfPlaced>& placed = to.content.of(layer).placed;
            for (std::int64_t row = 0; row < rows; ++row)
                for (std::int64_t column = 0; column < columns; ++column) {
                    const Vec3d moved(static_cast<double>(column) * step.x(), static_cast<double>(row) * step.y(), 0);
                    placed.push_back({block->name, *guise,
                                      first * Eigen::Translation3d(moved) * Eigen::Scaling(scale) *
                                          Eigen::Translation3d(-block->base)});
                }
        } else if (*guise && !sound) {
            addUnsound();
        }
    }
    // Its letters, which stand where they are, not where the block is.
    DxfGroups& groups = document_.groups();
    DxfGroups::Mark before = groups.mark();
    for (DxfRecord attribute; hasAttributes && groups.next(attribute); before = groups.mark()) {
        if (attribute.type == "SEQEND") break;
        if (attribute.type != "ATTRIB") {
            groups.goTo(before);
            break;
        }
        if ((attribute.integer(70, 0) & 1) == 0) addLetters(attribute, dxfLineOfText(attribute, document_), to);
    }
    return {};
}

Expected<const DxfGuise*> DxfReader::guise(const DxfBlock& block, const Inherited& inherited) {
    const auto known = looks_.find(&block);
    const auto keyOf = [&](const std::pair<bool, bool>& looks) {
        return GuiseKey(&block, looks.first ? inherited.layer : nullptr, looks.second ? inherited.color : DxfColor{});
    };
    if (known != looks_.end())
        if (const auto made = guises_.find(keyOf(known->second)); made != guises_.end()) return &made->second;
    if (open_.contains(&block)) {
        leftOut(fmt::format("blocks that hold themselves ({})", foreignName(block.name, "block")));
        return nullptr;
    }
    if (open_.size() >= kDeepest) {
        leftOut(fmt::format("blocks nested deeper than {} levels", kDeepest));
        return nullptr;
    }
    if (bytesOfBlocks_ > mostBytesOfBlocks_) {
        leftOut("blocks that look otherwise wherever they are, beyond what can be kept");
        return nullptr;
    }
    DxfGroups& groups = document_.groups();
    const DxfGroups::Mark back = groups.mark();
    open_.insert(&block);
    Reading reading{.inherited = inherited};
    groups.goTo(block.content);
    const Expected<void> done = readContent(reading);
    bytesOfBlocks_ += groups.mark().at - std::min(groups.mark().at, block.content.at);
    groups.goTo(back);
    open_.erase(&block);
    if (!done) return tl::unexpected(done.error());
    DxfGuise made{.byLayer = reading.byLayer, .byColor = reading.byColor};
    made.bounds = reading.content.bounds();
    made.letters = reading.content.letters;
    // What is on the insert's layer hides with that. A layer of the block's own needs a node where it is hidden, or not
    // the only one.
    const DxfLayer* direct = made.byLayer ? inherited.layer : nullptr;
    if (!direct && reading.content.layers.size() == 1 && !reading.content.layers.begin()->second.layer->hidden)
        direct = reading.content.layers.begin()->second.layer;
    proto::scene::Definition definition;
    made.nodes = emit(
                     reading.content, [&] { return definition.add_node(); }, direct) +
                 reading.content.placedNodes;
    if (isMeshAlone(definition)) {
        made.mesh = definition.node(0).geometry().mesh();
        made.material = definition.node(0).geometry().material();
        made.nodes = 0;
    } else if (definition.node_size() > 0) {
        made.definition = fmt::format("block {}", guises_.size());
        definition.set_name(made.definition);
        *scene_.file.add_definition() = std::move(definition);
    }
    const std::pair<bool, bool> looks(made.byLayer, made.byColor);
    looks_[&block] = looks;
    return &guises_.emplace(keyOf(looks), std::move(made)).first->second;
}

const std::string& DxfReader::material(DxfColor color, bool surface) {
    std::string& name = materials_[{color, surface}];
    if (!name.empty()) return name;
    name = fmt::format("{}{}", color.name(), surface ? " surface" : "");
    proto::scene::Material& made = *scene_.file.add_material();
    made.set_name(name);
    made.mutable_base_color()->set_r(color.linear().x());
    made.mutable_base_color()->set_g(color.linear().y());
    made.mutable_base_color()->set_b(color.linear().z());
    made.set_double_sided(true);
    made.set_unlit(!surface);
    return name;
}

std::size_t DxfReader::emit(DxfContent& content, const std::function<proto::scene::Node*()>& make,
                            const DxfLayer* direct) {
    std::size_t nodes = 0;
    for (auto& [key, layer] : content.layers) {
        std::function<proto::scene::Node*()> below = make;
        if (layer.layer != direct) {
            proto::scene::Node* const group = make();
            ++nodes;
            group->set_name(foreignName(layer.layer->name, "0"));
            if (layer.layer->hidden) group->mutable_switch_()->set_choice(kShowNone);
            below = [group] { return group->add_node(); };
        }
        for (auto& [color, bucket] : layer.buckets) nodes += emit(color, bucket, below);
        for (const DxfPlaced& placed : layer.placed) {
            if (placed.guise->definition.empty() && placed.guise->mesh.empty()) continue;
            proto::scene::Node* const node = addPlacedNode(below, foreignName(placed.name, "block"), placed.place);
            if (placed.guise->definition.empty()) {
                node->mutable_geometry()->set_mesh(placed.guise->mesh);
                node->mutable_geometry()->set_material(placed.guise->material);
            } else {
                node->set_instance(placed.guise->definition);
            }
        }
    }
    return nodes;
}

std::size_t DxfReader::emit(DxfColor color, DxfBucket& bucket, const std::function<proto::scene::Node*()>& make) {
    std::size_t nodes = 0;
    const auto add = [&](MeshData& data, const char* kind) {
        if (data.positions.empty()) return;
        proto::scene::Node* const node = make();
        ++nodes;
        node->set_name(fmt::format("{} {}", color.name(), kind));
        if (!bucket.origin.isZero())
            setTransform(*node->mutable_transform(), bucket.origin, Quatd::Identity(), Vec3d::Ones());
        const std::string mesh = fmt::format("mesh {}", meshes_++);
        node->mutable_geometry()->set_mesh(mesh);
        node->mutable_geometry()->set_material(material(color, data.primitive == Primitive::kTriangles));
        scene_.addModelMesh(mesh, std::move(data), limits_);
    };
    for (MeshData& lines : bucket.lines) add(lines, "lines");
    add(bucket.faces, "faces");
    add(bucket.points, "points");
    for (DxfLetters& letters : bucket.letters) {
        proto::scene::Node* const node = addPlacedNode(make, "text", letters.place);
        ++nodes;
        *node->mutable_text() = std::move(letters.text);
        node->mutable_text()->set_material(material(color, false));
    }
    return nodes;
}

}  // namespace tessera
