#include "common/export/PlannedTree.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "common/cores/Animation.h"
#include "common/cores/ApplicationData.h"
#include "common/cores/Camera.h"
#include "common/cores/CollisionObject.h"
#include "common/cores/ComponentTransform.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/Environment.h"
#include "common/cores/Glyphs.h"
#include "common/cores/Interest.h"
#include "common/cores/Manipulator.h"
#include "common/cores/Motion.h"
#include "common/cores/Movie.h"
#include "common/cores/PointLight.h"
#include "common/cores/Skin.h"
#include "common/cores/SpotLight.h"
#include "common/cores/Transform.h"
#include "common/drawable/Drawable.h"
#include "common/math/Decompositions.h"

namespace tessera {
namespace {

struct Lost {
    ObjectType type;
    std::string_view what;  ///< a note; empty: animations speak of it
};
constexpr Lost kLost[] = {{typeOf<Animation>(), ""},
                          {typeOf<Motion>(), ""},
                          {typeOf<Environment>(), "surroundings are left out"},
                          {typeOf<Interest>(), "rules of collisions are left out"},
                          {typeOf<ApplicationData>(), "data of applications are left out"},
                          {typeOf<Movie>(), "films are left out: their images stand still"},
                          {typeOf<Manipulator>(), "manipulators are left out"},
                          {typeOf<CollisionObject>(), "what collisions need is left out"}};

bool isLight(const Object& core) {
    return core && core.info().light != nullptr;
}

/// Drawn as a mesh of its node's own.
bool isShape(const SelectedNode& node) {
    return node.core && isDrawable(node.core.info().type) && !node.core.is<Glyphs>();
}

/// "part 12" → 12.
std::optional<unsigned> partNumber(std::string_view name) {
    constexpr std::string_view kPart = "part ";
    if (!name.starts_with(kPart)) return std::nullopt;
    unsigned number = 0;
    const char* const end = name.data() + name.size();
    const auto [read, error] = std::from_chars(name.data() + kPart.size(), end, number);
    if (error != std::errc() || read != end) return std::nullopt;
    return number;
}

/// Whether two primitives can be of one mesh of glTF's.
bool fitTogether(const Object& a, const Object& b) {
    const auto *skin = a.as<Skin>(), *other = b.as<Skin>();
    if (!skin || !other) return !skin && !other;
    const auto targets = [](const Skin& s) {
        return s.positions.empty() ? 0 : s.morphPositions.sizeBytes() / s.positions.sizeBytes();
    };
    return skin->joints == other->joints && skin->inverseBinds == other->inverseBinds &&
           skin->weights == other->weights && targets(*skin) == targets(*other) &&
           skin->jointIndices.empty() == other->jointIndices.empty();
}

/// translation · rotation · scale of what is no shear; else outer · inner.
struct Places {
    PlannedNode outer;
    std::optional<PlannedNode> inner;
};

Places placesOf(const Affine3d& map) {
    Places places;
    const Mat3d linear = map.linear();
    Vec3d lengths = linear.colwise().norm();
    const Mat3d gram = linear.transpose() * linear;
    const double slant = std::max({std::abs(gram(0, 1)), std::abs(gram(0, 2)), std::abs(gram(1, 2))});
    places.outer.translation = map.translation();
    if (slant <= 1e-12 * lengths.maxCoeff() * lengths.maxCoeff() && lengths.minCoeff() > 0) {
        if (linear.determinant() < 0) lengths.x() = -lengths.x();
        places.outer.rotation = Quatd(Mat3d(linear * lengths.cwiseInverse().asDiagonal()));
        places.outer.scale = lengths;
        return places;
    }
    SingularValues svd = singularValuesOf(linear);
    // Both must be rotations: a reflection moves into the scale between them.
    for (Mat3d* turn : {&svd.u, &svd.v})
        if (turn->determinant() < 0) turn->col(2) = -turn->col(2), svd.values.z() = -svd.values.z();
    places.outer.rotation = Quatd(svd.u);
    places.outer.scale = svd.values;
    places.inner.emplace();
    places.inner->rotation = Quatd(Mat3d(svd.v.transpose()));
    return places;
}

Places placesOf(const Selection& selection, const SelectedNode& node) {
    Places places;
    if (const auto* transform = node.core.as<Transform>()) {
        places.outer.translation = transform->translation;
        places.outer.rotation = transform->rotation;
        places.outer.scale = transform->scale;
    } else if (const auto* component = node.core.as<ComponentTransform>()) {
        // Its fields as they are, so that each can be animated.
        const Quatd turn = component->scaleOrientation.normalized();
        places.outer.translation = component->translation + component->center;
        places.outer.rotation = component->rotation.normalized() * turn;
        places.outer.scale = component->scale;
        if (component->center != Vec3d::Zero() || std::abs(turn.w()) < 1) {
            places.inner.emplace();
            places.inner->rotation = turn.conjugate();
            places.inner->translation = turn.conjugate() * Vec3d(-component->center);
        }
    } else if (node.core && node.core.info().pose) {
        places = placesOf(selection.parent_T_node(node));
    }
    return places;
}

class Planner {
public:
    Planner(const Aspect& scene, const Selection& selection, ExportNotes& notes)
        : scene_(scene), selection_(selection), notes_(notes) {
        tree_.moved.assign(selection.nodes.size(), -1);
        tree_.inner.assign(selection.nodes.size(), -1);
    }

    PlannedTree run() {
        for (const std::size_t top : selection_.tops)
            if (const int made = add(top); made >= 0) tree_.tops.push_back(made);
        for (const std::size_t light : elsewhere_) addAtBeacon(light);
        return std::move(tree_);
    }

private:
    int newNode(PlannedNode node) {
        node.rotation.normalize();
        tree_.nodes.push_back(std::move(node));
        return static_cast<int>(tree_.nodes.size()) - 1;
    }

    /// -1: nothing is to be seen of it.
    int add(std::size_t index) {
        const SelectedNode& node = selection_.nodes[index];
        if (node.core) {
            const ObjectType type = node.core.info().type;
            const auto* lost = std::ranges::find(kLost, type, &Lost::type);
            if (lost != std::end(kLost)) {
                if (!lost->what.empty() && !node.isWay) notes_.add(lost->what, node.id);
                if (node.children.empty() && type != typeOf<CollisionObject>()) return -1;
            }
        }
        // Within a world that turns and scales it back, a node may say more than files can.
        if (node.core && node.core.info().pose && !canStand(selection_.parent_T_node(node), node.id, notes_)) return -1;
        Places places = placesOf(selection_, node);
        // As readers call those without a name.
        places.outer.name = node.node->name.empty() ? "node" : node.node->name;
        const int outer = newNode(std::move(places.outer));
        int inner = outer;
        if (places.inner) {
            places.inner->name = "shear";
            inner = newNode(std::move(*places.inner));
            tree_.nodes[static_cast<std::size_t>(outer)].children.push_back(inner);
        }
        tree_.moved[index] = outer;
        tree_.inner[index] = inner;
        tree_.nodes[static_cast<std::size_t>(inner)].own = index;
        if (!node.isWay) addContent(index, inner);
        const std::size_t folded = foldParts(index, inner);
        for (std::size_t i = folded; i < node.children.size(); ++i)
            if (const int child = add(node.children[i]); child >= 0)
                tree_.nodes[static_cast<std::size_t>(inner)].children.push_back(child);
        return outer;
    }

    void addContent(std::size_t index, int at) {
        const SelectedNode& node = selection_.nodes[index];
        if (isShape(node)) tree_.nodes[static_cast<std::size_t>(at)].shapes.push_back(index);
        if (node.core.is<Glyphs>()) tree_.nodes[static_cast<std::size_t>(at)].glyphs = index;
        if (isLight(node.core)) addLight(index, at);
        const auto* camera = node.core.as<Camera>();
        if (!camera) return;
        // Its eye before the middle of the window; our node is the wall.
        const double scale = std::cbrt(std::abs(node.world_T_node.linear().determinant()));
        if (!(scale > 0)) return notes_.add("cameras of no size are left out", node.id);
        PlannedNode eye;
        eye.name = eye.cameraName = node.node->name;
        eye.camera = index;
        eye.yfov = 2 * std::atan(0.5 * kExportWindowHeight / kExportEyeDistance);
        eye.translation = Vec3d(0, kExportWindowCenterY, kExportEyeDistance) * (camera->worldUnitsPerMetre / scale);
        const int made = newNode(std::move(eye));
        tree_.nodes[static_cast<std::size_t>(at)].children.push_back(made);
    }

    void addLight(std::size_t index, int at) {
        const SelectedNode& node = selection_.nodes[index];
        const LightSource light = node.core.info().light(node.core.data());
        if (light.beacon && scene_.get<Node>(light.beacon) && light.beacon != node.id) {
            elsewhere_.push_back(index);
            return;
        }
        tree_.nodes[static_cast<std::size_t>(at)].light = index;
        tree_.nodes[static_cast<std::size_t>(at)].lightName = node.node->name;
    }

    /// A light whose beacon is another node stands there.
    void addAtBeacon(std::size_t index) {
        const SelectedNode& node = selection_.nodes[index];
        const auto found = selection_.byId.find(node.core.info().light(node.core.data()).beacon);
        const int beacon = found == selection_.byId.end() ? -1 : tree_.inner[found->second];
        if (beacon < 0) return notes_.add("lights whose beacon is left out are left out", node.id);
        PlannedNode lamp;
        lamp.name = lamp.lightName = node.node->name;
        lamp.light = lamp.own = index;
        const int made = newNode(std::move(lamp));
        tree_.nodes[static_cast<std::size_t>(beacon)].children.push_back(made);
    }

    /// How many of the leading children are the node's own mesh and light.
    std::size_t foldParts(std::size_t index, int at) {
        const SelectedNode& node = selection_.nodes[index];
        PlannedNode& planned = tree_.nodes[static_cast<std::size_t>(at)];
        std::size_t folded = 0;
        if (node.isWay || !planned.shapes.empty() || planned.glyphs) return 0;
        std::optional<unsigned> last;
        const auto leaf = [&](std::size_t child) -> const SelectedNode& { return selection_.nodes[child]; };
        if (!node.children.empty()) {
            const std::size_t first = node.children.front();
            if (leaf(first).core.is<Glyphs>() && leaf(first).children.empty() && partNumber(leaf(first).node->name)) {
                planned.glyphs = first;
                tree_.moved[first] = tree_.inner[first] = at;
                ++folded;
            }
        }
        for (const std::size_t child : node.children) {
            if (planned.glyphs) break;
            const std::optional<unsigned> part = partNumber(leaf(child).node->name);
            if (!part || (last && *part <= *last) || !leaf(child).children.empty() || !isShape(leaf(child))) break;
            if (!planned.shapes.empty() && !fitTogether(leaf(planned.shapes.front()).core, leaf(child).core)) break;
            planned.shapes.push_back(child);
            tree_.moved[child] = tree_.inner[child] = at;
            last = part;
            ++folded;
        }
        if (folded < node.children.size() && foldCamera(index, node.children[folded], at)) ++folded;
        if (folded < node.children.size() && !planned.light) {
            const SelectedNode& next = leaf(node.children[folded]);
            if (isLight(next.core) && next.children.empty() && !next.core.info().light(next.core.data()).beacon) {
                planned.light = node.children[folded];
                planned.lightName = next.node->name;
                tree_.moved[node.children[folded]] = tree_.inner[node.children[folded]] = at;
                ++folded;
            }
        }
        return folded;
    }

    /// Whether a child is what our importer makes of its parent's camera: the wall before it, moved alone.
    bool foldCamera(std::size_t index, std::size_t child, int at) {
        const SelectedNode& wall = selection_.nodes[child];
        const auto* moved = wall.core.as<Transform>();
        if (!moved || wall.children.size() != 1 || moved->scale != Vec3d::Ones() ||
            std::abs(moved->rotation.normalized().w()) < 1)
            return false;
        const SelectedNode& leaf = selection_.nodes[wall.children.front()];
        const auto* camera = leaf.core.as<Camera>();
        const double scale = std::cbrt(std::abs(selection_.nodes[index].world_T_node.linear().determinant()));
        if (!camera || !leaf.children.empty() || !(scale > 0)) return false;
        const Vec3d offset = moved->translation * scale;
        const double worldScale = camera->worldUnitsPerMetre, margin = 1e-6 * worldScale;
        if (std::abs(offset.x()) > margin || std::abs(offset.y() + kExportWindowCenterY * worldScale) > margin ||
            !(offset.z() < 0))
            return false;
        PlannedNode& planned = tree_.nodes[static_cast<std::size_t>(at)];
        planned.camera = wall.children.front();
        planned.cameraName = wall.node->name;
        planned.yfov = 2 * std::atan(0.5 * kExportWindowHeight * worldScale / -offset.z());
        for (const std::size_t gone : {child, wall.children.front()}) tree_.moved[gone] = tree_.inner[gone] = at;
        return true;
    }

    const Aspect& scene_;
    const Selection& selection_;
    ExportNotes& notes_;
    PlannedTree tree_;
    std::vector<std::size_t> elsewhere_;  ///< lights that stand at another node
};

}  // namespace

PlannedTree planTree(const Aspect& scene, const Selection& selection, ExportNotes& notes) {
    return Planner(scene, selection, notes).run();
}

bool hasItsJoints(const SelectedNode& node, const PlannedTree& tree, const Selection& selection) {
    const auto* skin = node.core.as<Skin>();
    if (!skin) return false;
    // Moved by an application: as it stands.
    if (skin->joints.empty()) return skin->jointIndices.empty();
    return std::ranges::all_of(skin->joints, [&](ObjectId joint) {
        const auto found = selection.byId.find(joint);
        return found != selection.byId.end() && tree.inner[found->second] >= 0;
    });
}

}  // namespace tessera
