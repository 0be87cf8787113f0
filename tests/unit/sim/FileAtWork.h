/// A file that is read again, into a scene that people have changed since.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/cores/Material.h"
#include "common/scene/Edits.h"
#include "server/sim/commit/Committer.h"
#include "server/sim/reload/ReloadPlan.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera::test {

/// What a file says, by hand: a tree of Transforms, each with what may hang below it.
struct Said {
    std::string name;
    Vec3d at = Vec3d::Zero();
    std::optional<double> box;   ///< an edge: a Geometry below it, called "shape"
    std::optional<float> rough;  ///< of that one's Material
    std::vector<Said> below;
};

inline void put(ListMaker& make, const Said& said, ObjectId parent) {
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

inline ChangeList fileOf(const std::vector<Said>& tops) {
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

inline std::string allNotes(const ReloadPlan& plan) {
    std::string text;
    for (const std::string& note : plan.notes) text += note + "\n";
    return text;
}
using Names = std::vector<std::string>;

inline const std::vector<Said> kHall = {{.name = "hall",
                                         .below = {{.name = "crane", .at = {1, 0, 0}, .box = 1, .rough = 0.5f},
                                                   {.name = "crate", .at = {2, 0, 0}, .box = 2},
                                                   {.name = "lamp"}}}};

}  // namespace tessera::test
