// A list that is spoilt in any one way is refused and leaves no trace, wherever in a random history it comes.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "common/cores/Transform.h"
#include "tests/property/SceneModel.h"

namespace tessera {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Spoiling {
    std::string_view name;
    /// Makes a valid list invalid. False: this list offers nothing to spoil that way.
    std::function<bool(ChangeList&, const SceneModel& scene, Random&)> spoil;
};

/// A row for a field that the list does not set yet, in a column of its own or an existing one.
bool addRow(ChangeList& list, ObjectId id, ObjectType type, FieldId field, const FieldValue& value) {
    for (FieldColumn& column : list.columns)
        if (column.type == type && column.field == field) {
            if (std::find(column.ids.begin(), column.ids.end(), id) != column.ids.end()) return false;
            column.append(id, value);
            return true;
        }
    list.columns.push_back(FieldColumn::ofShape(type, field, kindOf(value), widthOf(value)));
    list.columns.back().append(id, value);
    return true;
}

FieldColumn* someColumn(ChangeList& list, Random& random) {
    return list.columns.empty() ? nullptr : &list.columns[below(random, list.columns.size())];
}

FieldColumn* columnOf(ChangeList& list, FieldKind kind) {
    for (FieldColumn& column : list.columns)
        if (column.kind() == kind && !column.ids.empty()) return &column;
    return nullptr;
}

ObjectId inUse(const SceneModel& scene) {
    // `scene` stands behind the list: what is placed or named there stays so.
    for (const ObjectId id : scene.nodes())
        if (id != kRootNode) return id;
    return {};
}

const std::vector<Spoiling>& spoilings() {
    static const std::vector<Spoiling> all = {
        {"creates what exists",
         [](ChangeList& l, const SceneModel&, Random&) {
             return l.creations.push_back({kRootNode, typeOf<Group>()}), true;
         }},
        {"creates twice",
         [](ChangeList& l, const SceneModel&, Random& r) {
             return !l.creations.empty() && (l.creations.push_back(l.creations[below(r, l.creations.size())]), true);
         }},
        {"creates id 0",
         [](ChangeList& l, const SceneModel&, Random&) {
             return l.creations.push_back({ObjectId(), typeOf<Group>()}), true;
         }},
        {"creates a placeholder",
         [](ChangeList& l, const SceneModel&, Random&) {
             return l.creations.push_back({ObjectId(kFirstPlaceholder), typeOf<Group>()}), true;
         }},
        {"creates an unknown type",
         [](ChangeList& l, const SceneModel&, Random&) {
             return l.creations.push_back({ObjectId(1ull << 40), ObjectType(99)}), true;
         }},
        {"moves the root",
         [](ChangeList& l, const SceneModel&, Random&) {
             return l.placements.push_back({kRootNode, ObjectId()}), true;
         }},
        {"moves what is not there",
         [](ChangeList& l, const SceneModel&, Random&) {
             return l.placements.push_back({ObjectId(1ull << 40), kRootNode}), true;
         }},
        {"moves under what is not there",
         [](ChangeList& l, const SceneModel& s, Random&) {
             return inUse(s) && (l.placements.push_back({inUse(s), ObjectId(1ull << 40)}), true);
         }},
        {"moves a core",
         [](ChangeList& l, const SceneModel& s, Random&) {
             const auto cores = s.objectsOf(typeOf<Transform>());
             return !cores.empty() && (l.placements.push_back({cores[0], kRootNode}), true);
         }},
        {"moves under a core",
         [](ChangeList& l, const SceneModel& s, Random&) {
             const auto cores = s.objectsOf(typeOf<Transform>());
             return !cores.empty() && inUse(s) && (l.placements.push_back({inUse(s), cores[0]}), true);
         }},
        {"moves below itself",
         [](ChangeList& l, const SceneModel& s, Random&) {
             return inUse(s) && (l.placements.push_back({inUse(s), inUse(s)}), true);
         }},
        {"makes a cycle of two",
         [](ChangeList& l, const SceneModel& s, Random&) {
             const auto nodes = s.nodes();
             if (nodes.size() < 3) return false;
             l.placements.push_back({nodes[1], ObjectId()});
             l.placements.push_back({nodes[2], ObjectId()});
             l.placements.push_back({nodes[1], nodes[2]});
             l.placements.push_back({nodes[2], nodes[1]});
             return true;
         }},
        {"places past the last child",
         [](ChangeList& l, const SceneModel& s, Random&) {
             return inUse(s) && (l.placements.push_back({inUse(s), kRootNode, 1'000'000}), true);
         }},
        {"sets an unknown type's field",
         [](ChangeList& l, const SceneModel&, Random&) {
             return addRow(l, kRootNode, ObjectType(99), FieldId(1), std::int64_t{1});
         }},
        {"sets an unknown field",
         [](ChangeList& l, const SceneModel&, Random&) {
             return addRow(l, kRootNode, typeOf<Node>(), FieldId(99), std::int64_t{1});
         }},
        {"sets what is not there",
         [](ChangeList& l, const SceneModel&, Random&) {
             return addRow(l, ObjectId(1ull << 40), typeOf<Node>(), fieldId<&Node::name>, std::string("ghost"));
         }},
        {"sets a field of another type",
         [](ChangeList& l, const SceneModel&, Random&) {
             return addRow(l, kRootNode, typeOf<Transform>(), fieldId<&Transform::scale>, toValue(Vec3d(1, 1, 1)));
         }},
        {"sets a field twice",
         [](ChangeList& l, const SceneModel&, Random& r) {
             FieldColumn* column = someColumn(l, r);
             if (!column) return false;
             const std::size_t row = below(r, column->ids.size());
             column->append(column->ids[row], column->value(row));
             return true;
         }},
        {"says a column twice",
         [](ChangeList& l, const SceneModel&, Random& r) {
             const FieldColumn* column = someColumn(l, r);
             if (!column) return false;
             const FieldColumn again = *column;
             l.columns.push_back(again);
             return true;
         }},
        {"has a column of another width",
         [](ChangeList& l, const SceneModel&, Random&) {
             FieldColumn* column = columnOf(l, FieldKind::kDouble);
             return column && (column->width = static_cast<std::uint8_t>(column->width + 1), true);
         }},
        {"has a column of another kind",
         [](ChangeList& l, const SceneModel&, Random& r) {
             FieldColumn* column = someColumn(l, r);
             if (!column) return false;
             if (column->kind() == FieldKind::kInt)
                 column->values = std::vector<ObjectId>(column->ids.size());
             else
                 column->values = std::vector<std::int64_t>(column->ids.size());
             return true;
         }},
        {"has a row without a value",
         [](ChangeList& l, const SceneModel&, Random& r) {
             FieldColumn* column = someColumn(l, r);
             return column && (column->ids.push_back(kRootNode), true);
         }},
        {"holds a number that is not finite",
         [](ChangeList& l, const SceneModel&, Random& r) {
             FieldColumn* column = columnOf(l, FieldKind::kDouble);
             if (!column) return false;
             auto& numbers = std::get<std::vector<double>>(column->values);
             numbers[below(r, numbers.size())] = oneIn(r, 2) ? kNan : -std::numeric_limits<double>::infinity();
             return true;
         }},
        {"holds a float that is not finite",
         [](ChangeList& l, const SceneModel&, Random& r) {
             FieldColumn* column = columnOf(l, FieldKind::kFloat);
             if (!column) return false;
             auto& numbers = std::get<std::vector<float>>(column->values);
             numbers[below(r, numbers.size())] = static_cast<float>(kNan);
             return true;
         }},
        {"holds a rotation of zero",
         [](ChangeList& l, const SceneModel& s, Random&) {
             const auto transforms = s.objectsOf(typeOf<Transform>());
             return !transforms.empty() &&
                    addRow(l, transforms[0], typeOf<Transform>(), fieldId<&Transform::rotation>, Doubles{{}, 4});
         }},
        {"holds a text that is too long",
         [](ChangeList& l, const SceneModel&, Random&) {
             return addRow(l, kRootNode, typeOf<Node>(), fieldId<&Node::name>, std::string(4097, 'x'));
         }},
        {"holds a text that is not UTF-8",
         [](ChangeList& l, const SceneModel&, Random&) {
             return addRow(l, kRootNode, typeOf<Node>(), fieldId<&Node::name>, std::string("\xFF"));
         }},
        {"names a core that is not there",
         [](ChangeList& l, const SceneModel&, Random&) {
             return addRow(l, kRootNode, typeOf<Node>(), fieldId<&Node::core>, ObjectId(1ull << 40));
         }},
        {"names a node as a core",
         [](ChangeList& l, const SceneModel&, Random&) {
             return addRow(l, kRootNode, typeOf<Node>(), fieldId<&Node::core>, kRootNode);
         }},
        {"names a placeholder",
         [](ChangeList& l, const SceneModel&, Random&) {
             return addRow(l, kRootNode, typeOf<Node>(), fieldId<&Node::core>, ObjectId(kFirstPlaceholder));
         }},
        {"destroys the root",
         [](ChangeList& l, const SceneModel&, Random&) { return l.destructions.push_back(kRootNode), true; }},
        {"destroys what is not there", [](ChangeList& l, const SceneModel&,
                                          Random&) { return l.destructions.push_back(ObjectId(1ull << 40)), true; }},
        {"destroys twice",
         [](ChangeList& l, const SceneModel&, Random&) {
             return !l.destructions.empty() && (l.destructions.push_back(l.destructions[0]), true);
         }},
        {"destroys a node that has a parent",
         [](ChangeList& l, const SceneModel&, Random&) {
             l.creations.push_back({ObjectId(1ull << 40), typeOf<Node>()});
             l.placements.push_back({ObjectId(1ull << 40), kRootNode});
             l.destructions.push_back(ObjectId(1ull << 40));
             return true;
         }},
        {"destroys a node that has a child",
         [](ChangeList& l, const SceneModel&, Random&) {
             const ObjectId parent(1ull << 40), child((1ull << 40) + 1);
             l.creations.push_back({parent, typeOf<Node>()});
             l.creations.push_back({child, typeOf<Node>()});
             l.placements.push_back({child, parent});
             l.destructions.push_back(parent);
             return true;
         }},
        {"destroys a core in use",
         [](ChangeList& l, const SceneModel&, Random&) {
             const ObjectId core(1ull << 40);
             l.creations.push_back({core, typeOf<Group>()});
             l.destructions.push_back(core);
             return addRow(l, kRootNode, typeOf<Node>(), fieldId<&Node::core>, core);
         }},
        {"says a next free id among the placeholders",
         [](ChangeList& l, const SceneModel&, Random&) { return l.nextFreeId = kFirstPlaceholder + 1, true; }},
    };
    return all;
}

TEST(Laws, ARefusedListLeavesTheSceneAsItWas) {
    std::vector<std::size_t> spoilt(spoilings().size());
    forSeeds(20, [&](Random& random) {
        SceneModel model;
        Aspect aspect;
        for (int i = 0; i < 30; ++i) {
            const ChangeList list = model.nextList(random);
            const StateHash before = aspect.stateHash();
            const ChangeList whole = snapshot(aspect);
            for (std::size_t k = 0; k < spoilings().size(); ++k) {
                ChangeList bad = list;
                if (!spoilings()[k].spoil(bad, model, random)) continue;
                ++spoilt[k];
                ASSERT_FALSE(aspect.apply(bad)) << spoilings()[k].name;
                ASSERT_FALSE(aspect.applyWithInverse(bad)) << spoilings()[k].name;
                ASSERT_EQ(aspect.stateHash(), before) << spoilings()[k].name;
            }
            ASSERT_TRUE(snapshot(aspect) == whole);
            const Expected<void> done = aspect.apply(list);  // nothing of the refused ones was left in the way
            ASSERT_TRUE(done) << done.error().message;
            model.expectEqual(aspect);
            if (testing::Test::HasFailure()) return;
        }
    });
    for (std::size_t k = 0; k < spoilings().size(); ++k)
        if (!std::getenv("TESSERA_SEED")) {
            EXPECT_GT(spoilt[k], 50u) << "hardly ever tried: " << spoilings()[k].name;
        }
}

}  // namespace
}  // namespace tessera
