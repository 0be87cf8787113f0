#include "common/scene/DeclaredTable.h"

#include <cstring>
#include <map>

#include "tests/property/Seeds.h"
#include "tests/unit/scene/SceneEdits.h"

namespace tessera {
namespace {

DeclaredTable<double>::Form scoreForm() {
    return {.key = "test.score",
            .encode = [](const double& score) { return Blob::of(std::span<const double>(&score, 1)); },
            .decode = [](const Blob& data) -> std::optional<double> {
                const auto numbers = data.as<double>();
                return numbers.size() == 1 ? std::optional(numbers[0]) : std::nullopt;
            }};
}

/// As a server gives ids to placeholders.
ChangeList granted(ChangeList list, std::uint64_t& next) {
    std::map<ObjectId, ObjectId> ids;
    replaceIds(list, [&](ObjectId id) {
        if (id.value < kFirstPlaceholder) return id;
        const auto [at, isNew] = ids.try_emplace(id);
        if (isNew) at->second = ObjectId(next++);
        return at->second;
    });
    return list;
}

TEST(DeclaredTable, IsWhatTheSceneSays) {
    Aspect scene = hall();
    std::uint64_t next = 100;
    std::vector<std::string> told;
    DeclaredTable<double> scores(
        scoreForm(),
        {.changed =
             [&](ObjectId node, const double& score) {
                 told.push_back(std::to_string(node.value) + " " + std::to_string(static_cast<int>(score)));
             },
         .gone = [&](ObjectId node) { told.push_back(std::to_string(node.value) + " gone"); }});
    scores.lookAnew(scene);
    EXPECT_EQ(scores.size(), 0u);
    const auto apply = [&](const ChangeList& list) {
        const ChangeList given = granted(list, next);
        mustApply(scene, given);
        scores.follow(scene, given);
    };
    apply(scores.write(scene, ObjectId(3), 7));
    ASSERT_TRUE(scores.find(ObjectId(3)));
    EXPECT_EQ(*scores.find(ObjectId(3)), 7);
    EXPECT_TRUE(scores.write(scene, ObjectId(3), 7).empty()) << "it has it";
    apply(scores.write(scene, ObjectId(3), 8));
    apply(scores.write(scene, ObjectId(4), 1));
    apply(scores.erase(scene, ObjectId(3)));
    EXPECT_EQ(scores.find(ObjectId(3)), nullptr);
    EXPECT_TRUE(scores.erase(scene, ObjectId(3)).empty());
    EXPECT_TRUE(scores.write(scene, ObjectId(4711), 1).empty()) << "there is no such node";
    EXPECT_EQ(told, (std::vector<std::string>{"3 7", "3 8", "4 1", "3 gone"}));
    // Another one's bytes are nothing here; who joins late sees what there is.
    DeclaredTable<double> late(scoreForm());
    late.lookAnew(scene);
    EXPECT_EQ(late.size(), 1u);
    auto other = scoreForm();
    other.key = "test.other";
    DeclaredTable<double> others(other);
    others.lookAnew(scene);
    EXPECT_EQ(others.size(), 0u);
}

TEST(DeclaredTable, OverRandomHistoriesIsAsAFreshLook) {
    std::size_t most = 0;
    forSeeds(100, [&](Random& random) {
        Aspect scene = hall();
        std::uint64_t next = 100;
        DeclaredTable<double> scores(scoreForm());
        scores.lookAnew(scene);
        std::vector<ObjectId> nodes{kRootNode, ObjectId(2), ObjectId(3), ObjectId(4)};
        for (int turn = 0; turn < 150; ++turn) {
            const auto some = [&] { return nodes[below(random, nodes.size())]; };
            std::vector<ObjectId> cores;
            for (const ObjectId id : scene.ids())
                if (scene.get<ApplicationData>(id)) cores.push_back(id);
            Edits edits;
            ChangeList list;
            switch (below(random, 8)) {
                case 0:
                    edits.node(next, "more", some().value);
                    nodes.push_back(ObjectId(next++));
                    list = edits.take();
                    break;
                case 1:
                    edits.under(some().value, some().value);
                    list = edits.take();
                    break;
                case 2:
                    list = scores.erase(scene, some());
                    break;
                case 3:
                    if (!cores.empty())
                        edits.value<ApplicationData>(
                            cores[below(random, cores.size())].value, fieldId<&ApplicationData::key>,
                            toValue(std::string(oneIn(random, 2) ? "test.score" : "test.other")));
                    list = edits.take();
                    break;
                case 4:
                    if (!cores.empty()) edits.coreOfNode(some().value, cores[below(random, cores.size())].value);
                    list = edits.take();
                    break;
                case 5:
                    if (!cores.empty())
                        edits.value<ApplicationData>(cores[below(random, cores.size())].value,
                                                     fieldId<&ApplicationData::data>,
                                                     FieldValue(oneIn(random, 3) ? Blob() : scoreForm().encode(turn)));
                    list = edits.take();
                    break;
                default:
                    list = scores.write(scene, some(), turn);
            }
            const ChangeList given = granted(list, next);
            if (!scene.apply(given)) continue;  // a node below itself, the root below another
            scores.follow(scene, given);
            DeclaredTable<double> fresh(scoreForm());
            fresh.lookAnew(scene);
            ASSERT_EQ(scores.size(), fresh.size()) << "turn " << turn;
            for (const ObjectId id : scene.ids()) {
                const double *had = scores.find(id), *has = fresh.find(id);
                ASSERT_EQ(had != nullptr, has != nullptr) << "turn " << turn << ", #" << id.value;
                if (had) ASSERT_EQ(*had, *has);
            }
            most = std::max(most, scores.size());
        }
    });
    EXPECT_GT(most, 3u) << "nothing was tried";
}

}  // namespace
}  // namespace tessera
