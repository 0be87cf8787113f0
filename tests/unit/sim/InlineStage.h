/// A server's frames with Inlines and ProxyGroups.
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "common/cores/Inline.h"
#include "common/cores/ProxyGroup.h"
#include "server/sim/frame/InlineLoading.h"
#include "server/sim/frame/LoadParts.h"
#include "server/sim/frame/Simulation.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera::test {

/// A server's frames without its network: files are what the test says they are, and come when it says so.
class InlineStage {
public:
    InlineStage() : wall_(wallOfOne()), loading_(wall_) {
        wall_.users[0].position = Vec3d(0, 0.5, 2);
        view.users = wall_.users;
    }

    Simulation simulation;
    View view;
    LoadPartLimits parts{.changes = 12};
    std::size_t nodesInFile = 3;
    std::optional<Preparation> order;  ///< that nobody has answered
    std::vector<Edit> coming;          ///< parts of what is being put into the scene

    [[nodiscard]] const Aspect& scene() const { return simulation.scene(); }

    /// One frame with one edit, or none; what came of that.
    EditOutcome frame(std::optional<Edit> edit = std::nullopt) {
        std::vector<Edit> edits;
        if (!simulation.stepUnderWay())
            if (ChangeList states = loading_.advance(scene(), simulation.inlines(), view); !states.empty())
                edits.push_back({.ticket = InlineLoading::kTicket, .list = std::move(states), .undoable = false});
        if (std::optional<Preparation> next = loading_.takeOrder()) order = std::move(next);
        const bool step = edit && isStep(edit->kind);
        if (edit) edits.push_back(std::move(*edit));
        if (!coming.empty() && !step && !simulation.stepUnderWay()) {
            edits.push_back(std::move(coming.front()));
            coming.erase(coming.begin());
        }
        const FrameResult result = simulation.step(false, std::move(edits));
        EditOutcome mine{.ticket = 0};
        for (const EditOutcome& outcome : result.outcomes) {
            if (outcome.ticket == kMine) mine = outcome;
            if (outcome.ticket == InlineLoading::kTicket) {
                EXPECT_TRUE(outcome.result) << outcome.result.error().message;
            }
            if (outcome.ticket != kContent) continue;
            if (!outcome.result) coming.clear();
            if (!outcome.result || coming.empty())
                loading_.ended(answered_,
                               outcome.result ? std::nullopt : std::optional(outcome.result.error().message));
        }
        if (result.commit.list) {
            EXPECT_TRUE(replica.apply(*result.commit.list));
        }
        EXPECT_EQ(replica.stateHash(), scene().stateHash());
        return mine;
    }
    void frames(int count) {
        for (int i = 0; i < count; ++i) (void)frame();
    }
    EditOutcome edit(ChangeList list) { return frame(Edit{.ticket = kMine, .list = std::move(list)}); }
    EditOutcome undo() { return frame(Edit{.ticket = kMine, .list = {}, .kind = Edit::Kind::kUndo}); }
    EditOutcome redo() { return frame(Edit{.ticket = kMine, .list = {}, .kind = Edit::Kind::kRedo}); }

    /// The file that was ordered has been read: a node that is called like it, and others below.
    void fileComes() {
        ASSERT_TRUE(order);
        ListMaker make;
        const ObjectId top = make.node(order->path, order->node, make.transform(Vec3d(1, 0, 0)));
        for (std::size_t i = 1; i < nodesInFile; ++i) make.node("n" + std::to_string(i), top, make.box(Vec3d::Ones()));
        setLoadState(make.builder, order->content->core, order->content->type, LoadWords::kThere);
        ChangeList whole = make.builder.take();
        const std::size_t objects = whole.creations.size();
        std::vector<ChangeList> cut = cutForFrames(std::move(whole), parts);
        for (std::size_t i = 0; i < cut.size(); ++i) {
            Edit part{.ticket = kContent, .list = std::move(cut[i]), .undoable = false, .objects = objects};
            if (cut.size() > 1) part.kind = i + 1 == cut.size() ? Edit::Kind::kLastPart : Edit::Kind::kPart;
            coming.push_back(std::move(part));
        }
        answered_ = order->content->core;
        order.reset();
    }
    void fileFails(const std::string& why) {
        ASSERT_TRUE(order);
        loading_.ended(order->content->core, why);
        order.reset();
    }

    template <typename T = Inline>
    ObjectId place(T core, ObjectId parent = kRootNode) {
        ListMaker make;
        const ObjectId id = make.create<T>();
        setField<&T::file>(make.builder, id, core.file);
        setField<&T::load>(make.builder, id, core.load);
        setField<&T::distance>(make.builder, id, core.distance);
        if constexpr (std::is_same_v<T, ProxyGroup>) {
            setField<&T::lower>(make.builder, id, core.lower);
            setField<&T::upper>(make.builder, id, core.upper);
        }
        const ObjectId node = make.node("inline", parent, id);
        const EditOutcome outcome = edit(make.builder.take());
        EXPECT_TRUE(outcome.result) << outcome.result.error().message;
        if (!outcome.result) return {};
        for (const auto& [placeholder, made] : outcome.result->ids)
            if (placeholder == node) return made;
        return {};
    }
    [[nodiscard]] ObjectId coreOf(ObjectId node) const { return scene().get<Node>(node)->core; }
    [[nodiscard]] LoadWish wishOf(ObjectId node) const { return *loadWishOf(scene().find(coreOf(node))); }
    [[nodiscard]] std::string problemOf(ObjectId node) const { return scene().get<Inline>(coreOf(node))->problem; }
    template <auto kMember, typename V>
    EditOutcome set(ObjectId node, const V& value) {
        ChangeListBuilder edits;
        setField<kMember>(edits, coreOf(node), value);
        return edit(edits.take());
    }
    [[nodiscard]] std::size_t below(ObjectId node) const { return scene().get<Node>(node)->children.size(); }

    Aspect replica;

private:
    static constexpr std::uint64_t kMine = 7, kContent = 8;
    Wall wall_;
    InlineLoading loading_;
    ObjectId answered_;
};

}  // namespace tessera::test
