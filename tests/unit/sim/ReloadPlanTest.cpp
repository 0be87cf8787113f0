/// A file that is read again: what of it gets into a scene that people have changed since.
#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "common/cores/Material.h"
#include "common/scene/Edits.h"
#include "server/sim/commit/Committer.h"
#include "server/sim/reload/ReloadPlan.h"
#include "tests/property/Seeds.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera::test {
namespace {

/// What a file says, by hand: a tree of Transforms, each with what may hang below it.
struct Said {
    std::string name;
    Vec3d at = Vec3d::Zero();
    std::optional<double> box;   ///< an edge: a Geometry below it, called "shape"
    std::optional<float> rough;  ///< of that one's Material
    std::vector<Said> below;
};

void put(ListMaker& make, const Said& said, ObjectId parent) {
    const ObjectId node = make.node(said.name, parent, make.transform(said.at));
    if (said.box) {
        const ObjectId shape = make.box(Vec3d::Constant(*said.box));
        make.node("shape", node, shape);
        if (said.rough) {
            const ObjectId material = make.create<Material>();
            setField<&Material::roughness>(make.builder, material, *said.rough);
            setField<&Geometry::material>(make.builder, shape, material);
        }
    }
    for (const Said& child : said.below) put(make, child, node);
}

ChangeList fileOf(const std::vector<Said>& tops) {
    ListMaker make;
    for (const Said& top : tops) put(make, top, kRootNode);
    return make.builder.take();
}

/// A scene with one file in it.
class FileAtWork {
public:
    Committer committer;

    explicit FileAtWork(const std::vector<Said>& tops) {
        ChangeList list = fileOf(tops);
        auto held = std::make_shared<HeldFile>(*HeldFile::of(list));
        const Expected<Committer::Applied> applied = committer.apply(std::move(list));
        EXPECT_TRUE(applied) << applied.error().message;
        if (applied) held->standsFrom(applied->ids.front().second);
        file_ = held;
    }
    [[nodiscard]] const Aspect& scene() const { return committer.scene(); }
    [[nodiscard]] const HeldFile& held() const { return *file_; }

    /// The file has become this. `meanwhile`: what people do between the plan and its first frame.
    ReloadPlan becomes(const std::vector<Said>& tops, const ReloadPlan::Limits& limits = {},
                       const std::function<void()>& meanwhile = {}) {
        ChangeList list = fileOf(tops);
        HeldFile next = *HeldFile::of(list);
        change_ = std::make_shared<FileChange>(file_, std::move(list), std::move(next));
        Expected<ReloadPlan> plan = planReload(scene(), *change_, kRootNode, limits);
        EXPECT_TRUE(plan);
        if (meanwhile) meanwhile();
        ObjectId first = plan->creating > 0 ? committer.reserveIds(plan->objects) : ObjectId();
        for (std::size_t i = 0; i < plan->parts.size(); ++i) {
            ReloadPlan::Part& part = plan->parts[i];
            leaveOutWhatChanged(scene(), part, *plan);
            const bool made = i < plan->creating;
            if (plan->creating > 0 && !made)
                replaceIds(part.list, [&](ObjectId id) {
                    return isPlaceholder(id) ? ObjectId(first.value + id.value - kFirstPlaceholder) : id;
                });
            const Expected<Committer::Applied> applied =
                made ? committer.applyReserved(std::move(part.list), first, plan->objects)
                     : committer.apply(std::move(part.list));
            EXPECT_TRUE(applied) << "part " << i << ": " << applied.error().message;
            if (!applied) return *plan;
            if (plan->creating == 0 && plan->objects > 0) first = applied->ids.front().second;
            mostInAPart = std::max(mostInAPart, applied->list->changeCount());
        }
        for (std::size_t i = 0; i < plan->made.size(); ++i)
            change_->next.ids[plan->made[i]] = ObjectId(first.value + i);
        file_ = std::make_shared<HeldFile>(heldAfter(std::move(change_->next), *plan));
        return *plan;
    }
    std::size_t mostInAPart = 0;

    [[nodiscard]] ObjectId node(const std::string& path) const {
        const Expected<ObjectId> found = findNode(scene(), path);
        return found ? *found : ObjectId();
    }
    [[nodiscard]] ObjectId core(const std::string& path) const {
        const Node* found = scene().get<Node>(node(path));
        return found ? found->core : ObjectId();
    }
    void edit(ChangeList list) {
        const Expected<Committer::Applied> applied = committer.apply(std::move(list));
        ASSERT_TRUE(applied) << applied.error().message;
    }
    template <auto kMember>
    void set(ObjectId id, const typename FieldMember<decltype(kMember)>::Type& value) {
        ChangeListBuilder list;
        setField<kMember>(list, id, value);
        edit(list.take());
    }
    void remove(const std::string& path) { edit(*removalList(scene(), node(path))); }
    /// And a way back.
    [[nodiscard]] ChangeList removeForNow(const std::string& path) {
        Expected<Committer::Applied> applied =
            committer.apply(*removalList(scene(), node(path)), Committer::Inverse::kMade);
        EXPECT_TRUE(applied);
        (void)committer.closeFrame();  // what goes in a frame does not come back in it
        return applied ? std::move(applied->inverse) : ChangeList();
    }
    void bringBack(ChangeList list) {
        const auto applied = committer.applyInverse(std::make_shared<const ChangeList>(std::move(list)));
        ASSERT_TRUE(applied) << applied.error().message;
    }
    void add(const std::string& name, const std::string& below) {
        ListMaker make;
        make.node(name, below.empty() ? kRootNode : node(below));
        edit(make.builder.take());
    }
    /// Names of the children, in their order.
    [[nodiscard]] std::vector<std::string> below(const std::string& path) const {
        std::vector<std::string> names;
        for (const ObjectId child : scene().get<Node>(path.empty() ? kRootNode : node(path))->children)
            names.push_back(scene().get<Node>(child)->name);
        return names;
    }

private:
    std::shared_ptr<const HeldFile> file_;
    std::shared_ptr<FileChange> change_;
};

std::string allNotes(const ReloadPlan& plan) {
    std::string text;
    for (const std::string& note : plan.notes) text += note + "\n";
    return text;
}
using Names = std::vector<std::string>;

const std::vector<Said> kHall = {{.name = "hall",
                                  .below = {{.name = "crane", .at = {1, 0, 0}, .box = 1, .rough = 0.5f},
                                            {.name = "crate", .at = {2, 0, 0}, .box = 2},
                                            {.name = "lamp"}}}};

TEST(ReloadPlan, WhatHasNotChangedCostsNothing) {
    FileAtWork work(kHall);
    const StateHash before = work.scene().stateHash();
    const ReloadPlan plan = work.becomes(kHall);
    EXPECT_TRUE(plan.parts.empty() && plan.notes.empty());
    EXPECT_EQ(work.scene().stateHash(), before);
}

TEST(ReloadPlan, OneMeshIsOneChange) {
    FileAtWork work(kHall);
    const ObjectId shape = work.core("/hall/crane/shape"), material = work.scene().get<Geometry>(shape)->material;
    std::vector<Said> next = kHall;
    next[0].below[0].box = 3;
    const ReloadPlan plan = work.becomes(next);
    EXPECT_EQ(plan.changed, 1u) << "a cube's positions: normals and indices are the same arrays";
    EXPECT_EQ(work.mostInAPart, 1u);
    EXPECT_EQ(work.core("/hall/crane/shape"), shape);
    EXPECT_EQ(work.scene().get<Geometry>(shape)->material, material);
    EXPECT_EQ(plan.arrays.size(), 1u);
    EXPECT_TRUE(plan.arrays[0].resident());
}

TEST(ReloadPlan, WhatAPersonHasMovedStaysWhereTheyPutIt) {
    FileAtWork work(kHall);
    work.set<&Transform::translation>(work.core("/hall/crane"), Vec3d(7, 7, 7));
    std::vector<Said> next = kHall;
    next[0].below[0].rough = 0.25f;
    ReloadPlan plan = work.becomes(next);
    EXPECT_EQ(plan.changed, 1u);
    EXPECT_EQ(plan.kept, 0u) << "the file has not touched it";
    EXPECT_TRUE(plan.notes.empty()) << allNotes(plan);
    next[0].below[0].at = {1, 1, 1};
    next[0].below[1].at = {2, 2, 2};
    plan = work.becomes(next);
    EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crane"))->translation, Vec3d(7, 7, 7));
    EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crate"))->translation, Vec3d(2, 2, 2));
    EXPECT_EQ(plan.kept, 1u);
    EXPECT_EQ(allNotes(plan),
              "the Transform of /hall/crane: translation stays as it is here; the file has changed it too\n");
    next[0].below[0].at = {7, 7, 7};
    plan = work.becomes(next);
    EXPECT_TRUE(plan.notes.empty()) << "both say the same now: " << allNotes(plan);
    next[0].below[0].at = {8, 8, 8};
    plan = work.becomes(next);
    EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crane"))->translation, Vec3d(8, 8, 8))
        << "and the file leads again";
}

TEST(ReloadPlan, HalfOfAMeshIsNone) {
    FileAtWork work(kHall);
    const ObjectId shape = work.core("/hall/crane/shape");
    const MeshArrays other = makeBox(Vec3d(1, 2, 3)).toArrays();
    work.set<&Geometry::positions>(shape, other.positions);
    std::vector<Said> next = kHall;
    next[0].below[0].box = 3;
    next[0].below[0].rough = std::nullopt;  // the Geometry's material
    const ReloadPlan plan = work.becomes(next);
    EXPECT_EQ(work.scene().get<Geometry>(shape)->positions, other.positions);
    EXPECT_TRUE(work.scene().get<Geometry>(shape)->material) << "all of it stays";
    EXPECT_EQ(plan.kept, 2u) << allNotes(plan);
}

TEST(ReloadPlan, SiblingsComeAndGoAndAreKnownByTheirNames) {
    FileAtWork work(kHall);
    const ObjectId crane = work.node("/hall/crane"), lamp = work.node("/hall/lamp"), crate = work.node("/hall/crate");
    work.add("mine", "/hall");
    std::vector<Said> next = kHall;
    next[0].below.insert(next[0].below.begin(), {.name = "door", .box = 1});
    next[0].below.insert(next[0].below.begin() + 3, {.name = "rope"});
    ReloadPlan plan = work.becomes(next);
    EXPECT_EQ(work.below("/hall"), (Names{"door", "crane", "crate", "rope", "lamp", "mine"}));
    EXPECT_EQ(work.node("/hall/crane"), crane);
    EXPECT_EQ(work.node("/hall/lamp"), lamp);
    EXPECT_EQ(plan.objects, 6u) << "two nodes with Transforms, a shape with its node";
    next[0].below.erase(next[0].below.begin() + 1);  // the crane
    plan = work.becomes(next);
    EXPECT_EQ(work.below("/hall"), (Names{"door", "crate", "rope", "lamp", "mine"}));
    EXPECT_EQ(plan.removed, 5u) << "with its Transform, its shape, that one's node, and the Material";
    std::swap(next[0].below[0], next[0].below[1]);
    plan = work.becomes(next);
    EXPECT_EQ(work.below("/hall"), (Names{"crate", "door", "rope", "lamp", "mine"}));
    EXPECT_EQ(work.node("/hall/crate"), crate);
    EXPECT_EQ(plan.objects + plan.removed + plan.changed, 0u);
}

TEST(ReloadPlan, OfEqualNamesWhatSaysTheSameIsTheSame) {
    std::vector<Said> tops = {{.name = "row"}};
    for (int i = 0; i < 5; ++i) tops[0].below.push_back({.name = "seat", .at = {double(i), 0, 0}});
    FileAtWork work(tops);
    const ObjectId second = work.node("/row/seat[1]"), last = work.node("/row/seat[4]");
    work.set<&Transform::scale>(work.core("/row/seat[1]"), Vec3d(2, 2, 2));
    tops[0].below.erase(tops[0].below.begin());
    ReloadPlan plan = work.becomes(tops);
    EXPECT_EQ(work.node("/row/seat[0]"), second);
    EXPECT_EQ(work.scene().get<Transform>(work.core("/row/seat[0]"))->scale, Vec3d(2, 2, 2));
    EXPECT_EQ(plan.removed, 2u);
    EXPECT_EQ(plan.changed, 0u);
    tops[0].below[3].at = {9, 9, 9};
    plan = work.becomes(tops);
    EXPECT_EQ(work.node("/row/seat[3]"), last) << "the others say the same, so it is this one";
    EXPECT_EQ(plan.changed, 1u);
}

TEST(ReloadPlan, WhatPeopleRemovedStaysRemoved) {
    FileAtWork work(kHall);
    work.remove("/hall/crane");
    std::vector<Said> next = kHall;
    next[0].below[0].at = {5, 5, 5};
    next[0].below[0].below = {{.name = "hook"}};
    const ReloadPlan plan = work.becomes(next);
    EXPECT_EQ(work.below("/hall"), (Names{"crate", "lamp"}));
    EXPECT_NE(allNotes(plan).find("/hall/crane/hook is new in the file, below what was removed here"),
              std::string::npos)
        << allNotes(plan);
    EXPECT_EQ(plan.objects, 0u);
}

/// An undo brings it as it was before the file changed.
TEST(ReloadPlan, WhatIsRemovedAndBroughtBackIsAsTheFileHasItAfterAReload) {
    for (const bool twice : {false, true}) {
        FileAtWork work(kHall);
        const ObjectId crane = work.node("/hall/crane");
        ChangeList back = work.removeForNow("/hall/crane");
        std::vector<Said> next = kHall;
        next[0].below[0].at = {5, 5, 5};
        next[0].below[0].box = 3;
        next[0].below[0].rough = 0.25f;
        next[0].below[0].below = {{.name = "hook", .at = {1, 2, 3}, .box = 1, .below = {{.name = "eye"}}}};
        (void)work.becomes(next);
        if (twice) {
            next[0].below[0].at = {6, 6, 6};
            next[0].below[1].at = {2, 2, 2};
            const ReloadPlan plan = work.becomes(next);
            EXPECT_EQ(plan.changed, 1u);
            EXPECT_EQ(plan.kept, 0u);
        }
        work.bringBack(std::move(back));
        ASSERT_EQ(work.node("/hall/crane"), crane);
        EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crane"))->translation, Vec3d(1, 0, 0)) << "as it went";
        const ReloadPlan plan = work.becomes(next);
        EXPECT_EQ(plan.kept, 0u) << allNotes(plan);
        FileAtWork fresh(next);
        EXPECT_EQ(work.node("/hall/crane"), crane);
        EXPECT_EQ(work.below("/hall"), fresh.below("/hall"));
        EXPECT_EQ(work.below("/hall/crane"), fresh.below("/hall/crane"));
        EXPECT_TRUE(work.node("/hall/crane/hook/eye"));
        EXPECT_EQ(work.scene().objectCount(), fresh.scene().objectCount());
        EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crane"))->translation, next[0].below[0].at);
        EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crane/hook"))->translation, Vec3d(1, 2, 3));
        const Geometry& shape = *work.scene().get<Geometry>(work.core("/hall/crane/shape"));
        EXPECT_EQ(shape.positions, makeBox(Vec3d::Constant(3)).toArrays().positions);
        EXPECT_EQ(work.scene().get<Material>(shape.material)->roughness, 0.25f);
        const ReloadPlan more = work.becomes(next);
        EXPECT_TRUE(more.parts.empty() && more.notes.empty()) << allNotes(more);
    }
}

TEST(ReloadPlan, WhatIsRemovedAndBroughtBackGoesWithAReloadOfAFileThatHasItNoMore) {
    FileAtWork work(kHall);
    ChangeList back = work.removeForNow("/hall/crane");
    std::vector<Said> next = kHall;
    next[0].below.erase(next[0].below.begin());
    (void)work.becomes(next);
    (void)work.becomes(next);
    work.bringBack(std::move(back));
    const ReloadPlan plan = work.becomes(next);
    EXPECT_EQ(work.below("/hall"), (Names{"crate", "lamp"})) << allNotes(plan);
    EXPECT_EQ(work.scene().objectCount(), FileAtWork(next).scene().objectCount());
}

/// Its core and its material are others in the file by then.
TEST(ReloadPlan, WhatIsBroughtBackLeavesNothingBehindOfWhatItWas) {
    FileAtWork work(kHall);
    ChangeList back = work.removeForNow("/hall/crane/shape");
    std::vector<Said> next = kHall;
    next[0].below[0].rough.reset();
    (void)work.becomes(next);
    work.bringBack(std::move(back));
    (void)work.becomes(next);
    EXPECT_FALSE(work.scene().get<Geometry>(work.core("/hall/crane/shape"))->material);
    EXPECT_EQ(work.scene().objectCount(), FileAtWork(next).scene().objectCount());
}

TEST(ReloadPlan, WhatPeoplePutBelowANodeKeepsIt) {
    FileAtWork work(kHall);
    work.add("mine", "/hall/crane/shape");
    work.set<&Transform::translation>(work.core("/hall/crate"), Vec3d(7, 7, 7));
    std::vector<Said> next = kHall;
    next[0].below.erase(next[0].below.begin(), next[0].below.begin() + 2);
    const ReloadPlan plan = work.becomes(next);
    EXPECT_EQ(work.below("/hall"), (Names{"crane", "lamp"}));
    EXPECT_TRUE(work.node("/hall/crane/shape/mine"));
    EXPECT_NE(allNotes(plan).find("/hall/crane is not in the file any more, and stays: something here is below it"),
              std::string::npos)
        << allNotes(plan);
    EXPECT_NE(allNotes(plan).find(
                  "the Transform of /hall/crate has gone with the file; its translation had been changed here"),
              std::string::npos)
        << allNotes(plan);
}

TEST(ReloadPlan, WhatComesBackInTheFileSaysWhatItSaidBefore) {
    FileAtWork work(kHall);
    std::vector<Said> next = kHall;
    next[0].below.erase(next[0].below.begin());
    next[0].below[0].at = {4, 4, 4};
    (void)work.becomes(next);
    (void)work.becomes(kHall);
    FileAtWork fresh(kHall);
    EXPECT_EQ(work.below("/hall"), fresh.below("/hall"));
    EXPECT_EQ(work.scene().objectCount(), fresh.scene().objectCount());
    EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crate"))->translation, Vec3d(2, 0, 0));
}

TEST(ReloadPlan, WhatTheFileHandsToAnotherGoesWhereThatOneWasRemoved) {
    const std::vector<Said> before = {{.name = "a", .box = 1, .rough = 0.5f}, {.name = "b", .box = 2}};
    FileAtWork work(before);
    const ObjectId material = work.scene().get<Geometry>(work.core("/a/shape"))->material;
    work.remove("/b");
    (void)work.becomes({{.name = "a", .box = 1}, {.name = "b", .box = 2, .rough = 0.5f}});
    EXPECT_FALSE(work.scene().get<Geometry>(work.core("/a/shape"))->material);
    EXPECT_FALSE(work.scene().find(material)) << "nobody uses it any more";
}

TEST(ReloadPlan, WhatIsChangedWhileItIsPlannedStays) {
    FileAtWork work(kHall);
    std::vector<Said> next = kHall;
    next[0].below[0].at = {5, 5, 5};
    next[0].below[1].at = {6, 6, 6};
    const ReloadPlan plan =
        work.becomes(next, {}, [&] { work.set<&Transform::translation>(work.core("/hall/crane"), Vec3d(7, 7, 7)); });
    EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crane"))->translation, Vec3d(7, 7, 7));
    EXPECT_EQ(work.scene().get<Transform>(work.core("/hall/crate"))->translation, Vec3d(6, 6, 6));
    EXPECT_EQ(plan.kept, 1u);
    EXPECT_EQ(plan.changed, 1u);
    EXPECT_NE(allNotes(plan).find("while the file was read"), std::string::npos);
}

/// What the figures in server/sim/reload/README.md are measured by: --gtest_output=xml has them.
TEST(ReloadCost, OneMeshOfManyNodesIsOneChangeInAList) {
    for (const int nodes : {1'000, 100'000}) {
        std::vector<Said> tops = {{.name = "plant"}};
        for (int i = 0; i < nodes / 102; ++i) {
            Said hall{.name = "hall" + std::to_string(i), .at = {double(i), 0, 0}, .box = 1, .rough = 0.5f};
            for (int k = 0; k < 100; ++k)
                hall.below.push_back({.name = "part" + std::to_string(k), .at = {0, double(k), 0}});
            tops[0].below.push_back(std::move(hall));
        }
        FileAtWork work(tops);
        tops[0].below[3].box = 2;
        ChangeList list = fileOf(tops);
        const auto read = std::chrono::steady_clock::now();
        HeldFile next = *HeldFile::of(list);
        const auto former = std::make_shared<const HeldFile>(work.held());
        const FileChange change(former, std::move(list), std::move(next));
        const auto compared = std::chrono::steady_clock::now();
        Expected<ReloadPlan> plan = planReload(work.scene(), change, kRootNode);
        const auto planned = std::chrono::steady_clock::now();
        ASSERT_TRUE(plan);
        ASSERT_EQ(plan->parts.size(), 1u);
        leaveOutWhatChanged(work.scene(), plan->parts[0], *plan);
        const auto looked = std::chrono::steady_clock::now();
        EXPECT_EQ(plan->parts[0].list.changeCount(), 1u);
        const auto note = [&](const char* what, auto from, auto to) {
            RecordProperty(std::to_string(nodes) + " nodes, " + what + ", us",
                           static_cast<int>(std::chrono::duration<double, std::micro>(to - from).count()));
        };
        note("compare beside frames", read, compared);
        note("plan beside frames", compared, planned);
        note("last look in the frame", planned, looked);
        RecordProperty(std::to_string(nodes) + " nodes, KiB held", static_cast<int>(former->bytes >> 10));
        EXPECT_LT(former->bytes, static_cast<std::size_t>(nodes) * 512);
    }
}

// ---- hunts: random files, random edits in between, and what must come of it, worked out by names

class Hunt {
public:
    explicit Hunt(std::uint64_t seed) : random(seed) {}

    Random random;

    Said some(int depth) {
        Said said{.name = "n" + std::to_string(next_++), .at = place()};
        if (oneIn(random, 3)) said.box = 1 + static_cast<double>(below(random, 3));
        if (said.box && oneIn(random, 2)) said.rough = static_cast<float>(below(random, 4)) / 4;
        while (depth > 0 && oneIn(random, 2)) said.below.push_back(some(depth - 1));
        return said;
    }
    Vec3d place() { return Vec3d(static_cast<double>(below(random, 100)), 0, 0); }

    void change(std::vector<Said>& siblings, int depth) {
        for (std::size_t i = 0; i < siblings.size();) {
            Said& said = siblings[i];
            if (oneIn(random, 8)) {
                siblings.erase(siblings.begin() + static_cast<std::ptrdiff_t>(i));
                continue;
            }
            if (oneIn(random, 4)) said.at = place();
            if (oneIn(random, 6))
                said.box = oneIn(random, 3) ? std::nullopt : std::optional(1 + static_cast<double>(below(random, 3)));
            if (said.box && oneIn(random, 6))
                said.rough = oneIn(random, 3) ? std::nullopt : std::optional(static_cast<float>(below(random, 4)) / 4);
            if (!said.box) said.rough.reset();
            change(said.below, depth - 1);
            ++i;
        }
        if (oneIn(random, 3))
            siblings.insert(siblings.begin() + static_cast<std::ptrdiff_t>(below(random, siblings.size() + 1)),
                            some(std::max(depth, 0)));
        if (siblings.size() > 1 && oneIn(random, 5))
            std::swap(siblings[below(random, siblings.size())], siblings[below(random, siblings.size())]);
    }

private:
    int next_ = 0;
};

/// Of a file: where each node stands, by its path.
void placesOf(const std::vector<Said>& siblings, const std::string& above, std::map<std::string, Said>& all) {
    for (const Said& said : siblings) {
        all[above + "/" + said.name] = said;
        placesOf(said.below, above + "/" + said.name, all);
    }
}

void hunt(std::uint64_t seed, const ReloadPlan::Limits& limits) {
    Hunt hunt(seed);
    std::vector<Said> file;
    for (int i = 0; i < 3; ++i) file.push_back(hunt.some(3));
    FileAtWork work(file);
    std::map<std::string, Vec3d> moved;  // by people, since the file last said the same
    std::set<std::string> removed;       // by people
    std::set<std::string> mine;          // nodes of people
    for (int round = 0; round < 4; ++round) {
        std::map<std::string, Said> was, is;
        placesOf(file, "", was);
        // People, at random. Of what was removed before they know nothing any more.
        for (const auto& [path, said] : was) {
            const ObjectId node = work.node(path);
            if (!node || removed.contains(path)) continue;
            if (oneIn(hunt.random, 10)) {
                moved[path] = Vec3d(0, 1 + static_cast<double>(below(hunt.random, 5)), 0);
                work.set<&Transform::translation>(work.core(path), moved[path]);
            }
            if (oneIn(hunt.random, 14)) {
                const std::string name = "mine" + std::to_string(mine.size());
                work.add(name, path);
                mine.insert(path + "/" + name);
            }
            if (oneIn(hunt.random, 20)) {
                work.remove(path);
                for (const auto& [other, ignored] : was)
                    if (other == path || other.starts_with(path + "/")) removed.insert(other);
                std::erase_if(mine, [&, path = path](const std::string& one) { return one.starts_with(path + "/"); });
            }
        }
        std::map<std::string, ObjectId> ids;
        for (const auto& [path, said] : was)
            if (const ObjectId node = work.node(path)) ids[path] = node;

        hunt.change(file, 2);
        placesOf(file, "", is);
        const ReloadPlan plan = work.becomes(file, limits);
        ASSERT_FALSE(testing::Test::HasFailure());

        const auto below = [](const std::set<std::string>& paths, const std::string& path) {
            return std::ranges::any_of(paths, [&](const std::string& one) { return one.starts_with(path + "/"); });
        };
        const auto belowRemoved = [&](std::string path) {
            for (;; path.resize(path.rfind('/'))) {
                if (path.empty()) return false;
                if (removed.contains(path)) return true;
            }
        };
        std::size_t conflicts = 0;
        for (const auto& [path, said] : is) {
            const ObjectId node = work.node(path);
            if (belowRemoved(path)) {
                ASSERT_FALSE(node) << path << " was removed here";
                continue;
            }
            ASSERT_TRUE(node) << path << " is in the file";
            const auto before = was.find(path);
            if (before != was.end()) {
                ASSERT_EQ(node, ids.at(path)) << path << " keeps its id";
            }
            const Vec3d now = work.scene().get<Transform>(work.core(path))->translation;
            const bool changed = before != was.end() && before->second.at != said.at;
            if (moved.contains(path) && before != was.end()) {
                ASSERT_EQ(now, moved.at(path)) << path << " is where people put it";
                if (changed && said.at != moved.at(path)) {
                    ++conflicts;
                    if (plan.notes.size() < ReloadPlan::kMostNotes) {
                        ASSERT_NE(allNotes(plan).find("the Transform of " + path + ": translation stays"),
                                  std::string::npos)
                            << allNotes(plan);
                    }
                }
            } else {
                moved.erase(path);
                ASSERT_EQ(now, said.at) << path << " is where the file puts it";
            }
            if (!removed.contains(path + "/shape")) {
                const Geometry* shape = work.scene().get<Geometry>(work.core(path + "/shape"));
                ASSERT_EQ(shape != nullptr, said.box.has_value()) << path;
                if (shape) {
                    ASSERT_EQ(shape->positions, makeBox(Vec3d::Constant(*said.box)).toArrays().positions) << path;
                    ASSERT_EQ(static_cast<bool>(shape->material), said.rough.has_value()) << path;
                    if (said.rough) {
                        ASSERT_EQ(work.scene().get<Material>(shape->material)->roughness, *said.rough) << path;
                    }
                }
            }
            // In the file's order, whatever people have put between.
            Names order, wanted;
            for (const std::string& name : work.below(path))
                if (is.contains(path + "/" + name)) order.push_back(name);
            for (const Said& child : said.below)
                if (!belowRemoved(path + "/" + child.name)) wanted.push_back(child.name);
            ASSERT_EQ(order, wanted) << path;
        }
        ASSERT_EQ(plan.kept, conflicts) << allNotes(plan);
        for (const auto& [path, id] : ids) {
            if (is.contains(path)) continue;
            ASSERT_EQ(static_cast<bool>(work.node(path)), below(mine, path)) << path << " has gone from the file";
            if (below(mine, path)) {  // nobody's of the file any more
                mine.insert(path);
                moved.erase(path);
            }
        }
        for (const std::string& path : mine) ASSERT_TRUE(work.node(path)) << path << " is people's";
        // What went, people's or not, may come again under its name; what stays as people's is in its way by name
        // alone.
        std::erase_if(removed,
                      [&](const std::string& path) { return !is.contains(path) && !path.ends_with("/shape"); });
        if (std::ranges::any_of(mine, [&](const std::string& path) { return path.find("/mine") == std::string::npos; }))
            return;
        // Nothing is left over that nobody uses.
        for (const ObjectId id : work.scene().ids()) {
            if (work.scene().get<Node>(id)) continue;
            ASSERT_GT(work.scene().useCount(id), 0u) << "#" << id.value;
        }
    }
}

TEST(ReloadPlan, HuntsOverFilesAndPeople) {
    forSeeds(400, [](Random& random) { hunt(random(), {}); });
}

TEST(ReloadPlan, HuntsInParts) {
    forSeeds(400, [](Random& random) { hunt(random(), {.changes = 3, .whole = 0}); });
}

}  // namespace
}  // namespace tessera::test
