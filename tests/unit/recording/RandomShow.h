/// A simulation driven from a seed, recorded as the frame loop records it.
#pragma once

#include <cmath>
#include <deque>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "common/cores/CollisionObject.h"
#include "common/cores/Environment.h"
#include "common/cores/Motion.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"
#include "server/sim/frame/LoadParts.h"
#include "server/sim/frame/Simulation.h"
#include "server/sim/recording/RecordingWriter.h"
#include "tests/property/Seeds.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera::test {

inline bool oneInTwo(Random& random) {
    return below(random, 2) == 0;
}
inline double between(Random& random, double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
}

inline record::Opening openingForTests() {
    return {.schema = schemaHash(),
            .program = "unit_recording",
            .instructionSet = "none",
            .threads = 1,
            .limits = {},
            .collisionLimits = digestOf(CollisionLimits())};
}

/// Boxes on and above a floor, some of them free bodies, one on a motion; interests of every kind of response and mode.
class RandomShow {
public:
    explicit RandomShow(Random& random) : random_(random) {}

    [[nodiscard]] ChangeList startScene() {
        ListMaker make;
        const ObjectId environment = make.create<Environment>();
        make.builder.set(environment, typeOf<Environment>(), fieldId<&Environment::gravity>,
                         toValue(Vec3d(0, -9.81, 0)));
        make.node("environment", kRootNode, environment);
        const ObjectId floor = make.node("floor", kRootNode, make.transform(Vec3d(0, -1, 0)));
        make.node("slab", floor, make.box(Vec3d(20, 1, 20)));
        const ObjectId yard = make.node("yard", kRootNode);
        ObjectId first{};
        for (int i = 0; i < 8; ++i) {
            const ObjectId place =
                make.transform(Vec3d(between(random_, -4, 4), between(random_, 0, 4), between(random_, -4, 4)));
            const ObjectId node = make.node("body" + std::to_string(i), yard, place);
            make.node("shape", node, make.box(Vec3d::Constant(between(random_, 0.4, 1.2))));
            if (i == 0) {
                first = place;
                continue;
            }
            const ObjectId object = make.create<CollisionObject>();
            make.builder.set(object, typeOf<CollisionObject>(), fieldId<&CollisionObject::node>, node);
            if (i % 2 == 0)
                make.builder.set(object, typeOf<CollisionObject>(), fieldId<&CollisionObject::mass>, toValue(1.0 + i));
            make.node("rule" + std::to_string(i), kRootNode, object);
        }
        make.node("motion", kRootNode, make.motion(first, {{0, -5, 0.5, 0}, {0.4, 5, 0.5, 0}, {0.8, -5, 0.5, 0}}));
        for (int i = 0; i < 3; ++i) {
            const ObjectId interest = make.create<Interest>();
            make.builder.set(interest, typeOf<Interest>(), fieldId<&Interest::object>, yard);
            make.builder.set(interest, typeOf<Interest>(), fieldId<&Interest::response>,
                             toValue(static_cast<std::int64_t>(below(random_, 6))));
            make.builder.set(interest, typeOf<Interest>(), fieldId<&Interest::mode>,
                             toValue(static_cast<std::int64_t>(below(random_, 6))));
            make.builder.set(interest, typeOf<Interest>(), fieldId<&Interest::threshold>, toValue(0.5));
            make.builder.set(interest, typeOf<Interest>(), fieldId<&Interest::show>,
                             toValue(static_cast<std::int64_t>(below(random_, 8))));
            make.node("interest" + std::to_string(i), kRootNode, interest);
        }
        return make.builder.take();
    }

    /// Edits and replies as a bad day brings them.
    [[nodiscard]] std::vector<Edit> someEdits() {
        std::vector<Edit> edits;
        for (std::size_t i = below(random_, 4); i > 0; --i) edits.push_back(someEdit());
        if (const std::optional<Edit> part = somePart(edits)) edits.push_back(*part);
        return edits;
    }
    [[nodiscard]] std::vector<Reply> someReplies() {
        std::vector<Reply> replies;
        for (const Question& question : asked_)
            if (below(random_, 2) == 0)
                replies.push_back({.question = question.id + below(random_, 8) / 7,
                                   .decision = static_cast<Reply::Decision>(below(random_, 3)),
                                   .pose = {.translation = somePlace()}});
        return replies;
    }

    /// The same without a recording: first the scene, then frame after frame.
    [[nodiscard]] Expected<CommittedFrame> load() {
        std::vector<ChangeList> lists;
        lists.push_back(startScene());
        return simulation_.load(std::move(lists));
    }
    [[nodiscard]] FrameResult frame(FrameNumber number) {
        std::vector<Edit> edits = someEdits();
        const std::vector<Reply> replies = someReplies();
        FrameResult result = simulation_.step(number == FrameNumber(0), std::move(edits), replies);
        asked_ = result.collision.questions;
        return result;
    }
    [[nodiscard]] Simulation& simulation() { return simulation_; }
    /// Gestures end with the connections of who makes them.
    void connectAnew() { ++connection_; }

    /// Loads the scene and makes the frames, all of it recorded. What came of each frame is returned.
    std::vector<FrameDigest> record(RecordingWriter& writer, std::uint64_t frames) {
        std::vector<ChangeList> lists{startScene()};
        writer.startScene(lists);
        const Expected<CommittedFrame> loaded = simulation_.load(std::move(lists));
        EXPECT_TRUE(loaded) << (loaded ? "" : loaded.error().message);
        if (loaded) writer.started(*loaded);
        std::vector<FrameDigest> digests;
        for (std::uint64_t frame = 0; frame < frames; ++frame) {
            std::vector<Edit> edits = someEdits();
            const std::vector<Reply> replies = someReplies();
            writer.frameBegins(FrameNumber(frame), frame == 0, edits, replies);
            const FrameResult result = simulation_.step(frame == 0, std::move(edits), replies);
            writer.frameDone(FrameNumber(frame), result);
            asked_ = result.collision.questions;
            if (!parts_.empty() && std::ranges::any_of(result.outcomes, [&](const EditOutcome& o) {
                    return o.ticket == parts_.front().ticket && !o.result;
                }))
                parts_.clear();
            shownInParts_ +=
                static_cast<std::uint64_t>(std::ranges::count_if(result.outcomes, [](const EditOutcome& o) {
                    return o.result && o.result->ids.size() == 1 && o.result->ids[0].first.value == kFirstPlaceholder;
                }));
            contacts_ += result.collision.contacts.size();
            refused_ += static_cast<std::uint64_t>(
                std::ranges::count_if(result.outcomes, [](const EditOutcome& o) { return !o.result; }));
            digests.push_back(digestOf(result));
        }
        return digests;
    }
    [[nodiscard]] std::uint64_t contacts() const { return contacts_; }
    [[nodiscard]] std::uint64_t refused() const { return refused_; }
    [[nodiscard]] std::uint64_t shownInParts() const { return shownInParts_; }

private:
    [[nodiscard]] Vec3d somePlace() {
        return {between(random_, -5, 5), between(random_, -1, 4), between(random_, -5, 5)};
    }
    [[nodiscard]] ObjectId someOf(ObjectType type) {
        std::vector<ObjectId> all;
        for (const ObjectId id : simulation_.scene().ids())
            if (typeOf(simulation_.scene().find(id)) == type) all.push_back(id);
        return all.empty() ? ObjectId{} : all[below(random_, all.size())];
    }
    /// A file that is loaded while all that goes on, as a desk hands its parts on.
    [[nodiscard]] std::optional<Edit> somePart(const std::vector<Edit>& edits) {
        if (simulation_.stepUnderWay() || std::ranges::any_of(edits, isStep, &Edit::kind) || below(random_, 3) == 0)
            return std::nullopt;
        if (parts_.empty()) {
            ListMaker make;
            const std::size_t seen = 1 + below(random_, 20);
            ObjectId below = make.node("loaded", oneInTwo(random_) ? someOf(typeOf<Node>()) : kRootNode);
            for (int i = 0; i < 8; ++i) {
                const ObjectId place = make.transform(somePlace());
                below = make.node("inside", below, place);
                make.node("shape", below, make.box(Vec3d::Constant(between(random_, 0.4, 1.2))));
                if (i == 3) make.node("motion", below, make.motion(place, {{0, 0, 0, 0}, {1, 1, 0, 0}}));
            }
            ChangeList whole = make.builder.take();
            const std::size_t objects = whole.creations.size();
            std::vector<ChangeList> parts = cutForFrames(std::move(whole), {.changes = 20, .seen = seen});
            ++ticket_;
            for (ChangeList& list : parts)
                parts_.push_back(
                    {.ticket = ticket_, .list = std::move(list), .kind = Edit::Kind::kPart, .objects = objects});
            parts_.back().kind = Edit::Kind::kLastPart;
        }
        Edit part = std::move(parts_.front());
        parts_.pop_front();
        return part;
    }

    [[nodiscard]] Edit someEdit() {
        Edit edit{.ticket = ++ticket_};
        ChangeListBuilder builder;
        switch (below(random_, 8)) {
            case 0:
                edit.kind = oneInTwo(random_) ? Edit::Kind::kUndo : Edit::Kind::kRedo;
                return edit;
            case 1: {  // a new body, with arrays that nobody has seen
                ListMaker make;
                const ObjectId node = make.node("new", kRootNode, make.transform(somePlace()));
                make.node("shape", node, make.box(Vec3d(between(random_, 0.2, 1), 0.5, 0.5)));
                edit.list = make.builder.take();
                edit.undoable = below(random_, 4) != 0;
                edit.gesture = {connection_, below(random_, 3)};
                return edit;
            }
            case 2:
                builder.set(someOf(typeOf<Motion>()), typeOf<Motion>(), fieldId<&Motion::playing>,
                            toValue(static_cast<std::int64_t>(below(random_, 2))));
                break;
            case 3: {  // refused where something still hangs on it
                const ObjectId node = someOf(typeOf<Node>());
                builder.detach(node);
                builder.destroy(node);
                break;
            }
            case 4:
                builder.set(someOf(typeOf<Transform>()), typeOf<Transform>(), fieldId<&Transform::translation>,
                            toValue(Vec3d(std::numeric_limits<double>::quiet_NaN(), 0, 0)));
                break;
            case 5:  // by so much, or to a place; some of no Transform, some by numbers that are none
                edit.node = someOf(oneInTwo(random_) ? typeOf<Node>() : typeOf<Motion>());
                edit.move = NodeMove{.translation = somePlace(), .relative = below(random_, 4) != 0};
                if (below(random_, 8) == 0) edit.move->scale = Vec3d(1, std::numeric_limits<double>::infinity(), 1);
                if (oneInTwo(random_)) edit.move->rotation = Quatd(1, between(random_, -1, 1), 0, 0);
                return edit;
            default:
                for (int i = 0; i < 3; ++i)
                    builder.set(someOf(typeOf<Transform>()), typeOf<Transform>(), fieldId<&Transform::translation>,
                                toValue(somePlace()));
        }
        edit.list = builder.take();
        return edit;
    }

    Random& random_;
    Simulation simulation_;
    std::vector<Question> asked_;
    std::deque<Edit> parts_;  ///< of the file under way
    std::uint64_t connection_ = 1;
    std::uint64_t ticket_ = 0, contacts_ = 0, refused_ = 0, shownInParts_ = 0;
};

}  // namespace tessera::test
