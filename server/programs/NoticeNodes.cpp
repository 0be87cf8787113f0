#include "server/programs/NoticeNodes.h"

#include "common/cores/Billboard.h"
#include "common/cores/CollisionObject.h"
#include "common/cores/Geometry.h"
#include "common/cores/Material.h"
#include "common/cores/Text.h"
#include "common/cores/Transform.h"
#include "common/scene/Edits.h"
#include "common/scene/ServerNodes.h"

namespace tessera {
namespace {

constexpr double kLineSpacing = 1.2, kAdvance = 0.605;  ///< ems; of a monospaced letter
constexpr double kMargin = 0.6;

template <typename Core>
const Node* childOf(const Aspect& scene, const Node& parent, std::size_t index, std::size_t children) {
    if (parent.children.size() != children) return nullptr;
    const Node* child = scene.get<Node>(parent.children[index]);
    return scene.coreOf<Core>(*child) ? child : nullptr;
}

std::optional<PresentNotice> readNotice(const Aspect& scene, const Node& node) {
    if (node.name != "notice" || !scene.coreOf<Transform>(node)) return std::nullopt;
    const Node* turn = childOf<Billboard>(scene, node, 0, 1);
    const Node* plate = turn ? childOf<Transform>(scene, *turn, 0, 2) : nullptr;
    const Node* lines = turn ? childOf<Transform>(scene, *turn, 1, 2) : nullptr;
    const Node* shape = plate ? childOf<Geometry>(scene, *plate, 0, 1) : nullptr;
    const Node* words = lines ? childOf<Text>(scene, *lines, 0, 1) : nullptr;
    if (!shape || !words || !shape->children.empty() || !words->children.empty()) return std::nullopt;
    const Geometry& sheet = *scene.coreOf<Geometry>(*shape);
    if (sheet.positions != noticePlate().positions || sheet.indices != noticePlate().indices ||
        !scene.get<Material>(sheet.material))
        return std::nullopt;
    return PresentNotice{.place = node.core, .plate = plate->core, .lines = lines->core, .text = words->core};
}

void setPlace(ChangeListBuilder& list, ObjectId id, const Transform& from, const Vec3d& translation,
              const Vec3d& scale) {
    if (translation != from.translation) setField<&Transform::translation>(list, id, translation);
    if (from.rotation.coeffs() != Quatd::Identity().coeffs())
        setField<&Transform::rotation>(list, id, Quatd::Identity());
    if (scale != from.scale) setField<&Transform::scale>(list, id, scale);
}

/// Makes nodes and cores, with placeholders.
class NoticeBuild {
public:
    explicit NoticeBuild(ChangeListBuilder& list) : list_(list) {}

    template <typename Core>
    ObjectId make() {
        const ObjectId id{kFirstPlaceholder + placeholders_++};
        list_.create(id, typeOf<Core>());
        return id;
    }
    ObjectId node(ObjectId parent, std::string_view name, ObjectId core) {
        const ObjectId id = make<Node>();
        setField<&Node::name>(list_, id, std::string(name));
        setField<&Node::core>(list_, id, core);
        list_.place(id, parent);
        return id;
    }
    /// Seen as it is, whatever shines on it. Letters are opaque: what is blended would be sorted among the triangles of
    /// the sheet behind them.
    ObjectId material(const Vec4f& color) {
        const ObjectId id = make<Material>();
        setField<&Material::baseColor>(list_, id, color);
        setField<&Material::unlit>(list_, id, true);
        setField<&Material::doubleSided>(list_, id, true);
        return id;
    }

private:
    ChangeListBuilder& list_;
    std::uint64_t placeholders_ = 0;
};

}  // namespace

Vec3d WantedNotice::plateSize() const {
    return {static_cast<double>(words.columns) * kAdvance + 2 * kMargin,
            static_cast<double>(words.lines - 1) * kLineSpacing + 1 + 2 * kMargin, 1};
}

double WantedNotice::firstLine() const {
    return 0.5 * static_cast<double>(words.lines - 1) * kLineSpacing - 0.25;
}

const MeshArrays& noticePlate() {
    static const MeshArrays shape = [] {
        MeshData sheet;
        sheet.positions = {-0.5f, -0.5f, 0, 0.5f, -0.5f, 0, 0.5f, 0.5f, 0, -0.5f, 0.5f, 0};
        sheet.normals = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
        sheet.indices = {0, 1, 2, 0, 2, 3};
        return sheet.toArrays();
    }();
    return shape;
}

std::optional<std::vector<PresentNotice>> readNotices(const Aspect& scene, const Node& top) {
    std::vector<PresentNotice> all;
    for (std::size_t i = 0; i < top.children.size(); ++i) {
        const std::optional<PresentNotice> one = readNotice(scene, *scene.get<Node>(top.children[i]));
        if (!one) return std::nullopt;
        all.push_back(*one);
    }
    return all;
}

std::vector<ObjectId> othersBelow(const Aspect& scene, const Node& top) {
    const auto isOurs = [&](const Node& node) {
        if (node.name == "notice" || node.name == "plate" || node.name == "lines")
            return scene.coreOf<Transform>(node) != nullptr;
        if (node.name == "turn") return scene.coreOf<Billboard>(node) != nullptr;
        return (node.name == "shape" && scene.coreOf<Geometry>(node)) ||
               (node.name == "words" && scene.coreOf<Text>(node));
    };
    std::vector<ObjectId> others;
    std::vector<const Node*> open{&top};
    while (!open.empty()) {
        const Node* node = open.back();
        open.pop_back();
        for (std::size_t i = 0; i < node->children.size(); ++i) {
            const Node* child = scene.get<Node>(node->children[i]);
            isOurs(*child) ? open.push_back(child) : others.push_back(node->children[i]);
        }
    }
    return others;
}

void setNotice(const Aspect& scene, ChangeListBuilder& list, const PresentNotice& now, const WantedNotice& wanted) {
    const auto transform = [&](ObjectId id) {
        const Transform* present = scene.get<Transform>(id);
        return present ? *present : Transform();
    };
    const Text* text = scene.get<Text>(now.text);
    setPlace(list, now.place, transform(now.place), wanted.at, Vec3d::Constant(wanted.em));
    setPlace(list, now.plate, transform(now.plate), Vec3d(0, 0, -0.1), wanted.plateSize());
    setPlace(list, now.lines, transform(now.lines), Vec3d(0, wanted.firstLine(), 0), Vec3d::Ones());
    if (!text || text->text != wanted.words.text) setField<&Text::text>(list, now.text, wanted.words.text);
    if (!text || text->alignment != Text::kCenter) setField<&Text::alignment>(list, now.text, Text::kCenter);
    if (!text || text->font != "monospace") setField<&Text::font>(list, now.text, std::string("monospace"));
}

void buildNotices(const Aspect& scene, ChangeListBuilder& list, const std::vector<WantedNotice>& wanted) {
    NoticeBuild build(list);
    const ObjectId object = build.make<CollisionObject>();
    const ObjectId top = build.node(kRootNode, kProgramNoticesName, object);
    setField<&Node::ofServer>(list, top, true);
    setField<&CollisionObject::node>(list, object, top);
    setField<&CollisionObject::layers>(list, object, std::int64_t{0});
    const ObjectId dark = build.material(Vec4f(0.02f, 0.0f, 0.02f, 0.85f)),
                   bright = build.material(Vec4f(1.0f, 0.92f, 0.6f, 1.0f));
    const ObjectId sheet = build.make<Geometry>();
    setField<&Geometry::positions>(list, sheet, noticePlate().positions);
    setField<&Geometry::normals>(list, sheet, noticePlate().normals);
    setField<&Geometry::indices>(list, sheet, noticePlate().indices);
    setField<&Geometry::material>(list, sheet, dark);
    for (const WantedNotice& one : wanted) {
        const PresentNotice made{.place = build.make<Transform>(),
                                 .plate = build.make<Transform>(),
                                 .lines = build.make<Transform>(),
                                 .text = build.make<Text>()};
        const ObjectId about = build.make<Billboard>();
        setField<&Billboard::axis>(list, about, Vec3d::Zero().eval());
        const ObjectId turn = build.node(build.node(top, "notice", made.place), "turn", about);
        (void)build.node(build.node(turn, "plate", made.plate), "shape", sheet);
        setField<&Text::material>(list, made.text, bright);
        (void)build.node(build.node(turn, "lines", made.lines), "words", made.text);
        setNotice(scene, list, made, one);
    }
}

bool noticesAreLast(const Aspect& scene, ObjectId top) {
    const auto& children = scene.root().children;
    for (std::size_t i = children.size(); i > 0; --i) {
        if (children[i - 1] == top) return true;
        const Node* node = scene.get<Node>(children[i - 1]);
        if (node->name != kContactsName || !node->ofServer) return false;
    }
    return true;
}

}  // namespace tessera
