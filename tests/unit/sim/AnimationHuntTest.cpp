/// Animations of any field to any values, stopped and going on again, while people edit what they drive: the server
/// lives, and a replica follows.
#include <gtest/gtest.h>

#include <array>
#include <set>

#include "common/cores/Animation.h"
#include "common/cores/DistanceLOD.h"
#include "server/sim/frame/Simulation.h"
#include "tests/property/Seeds.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

using test::ListMaker;
using test::one;

Blob keyArray(const std::vector<double>& numbers) {
    return Blob::of(std::span<const double>(numbers));
}

ObjectId framesOf(ListMaker& make, ObjectId target, std::string_view field, const std::vector<double>& times,
                  const std::vector<double>& values, std::int64_t interpolation) {
    const ObjectId id = make.create<KeyFrames>();
    setField<&KeyFrames::target>(make.builder, id, target);
    setField<&KeyFrames::field>(make.builder, id, std::string(field));
    setField<&KeyFrames::times>(make.builder, id, keyArray(times));
    setField<&KeyFrames::values>(make.builder, id, keyArray(values));
    setField<&KeyFrames::interpolation>(make.builder, id, interpolation);
    return id;
}

/// A thing of whose collisions the scene wants to know, at a Transform: what its scale of 0 stops is stopped.
ObjectId watchedThing(ListMaker& make) {
    const ObjectId place = make.transform(Vec3d::Zero());
    const ObjectId thing = make.node("thing", kRootNode, place);
    make.node("shape", thing, make.box(Vec3d::Ones()));
    const ObjectId interest = make.create<Interest>();
    setField<&Interest::object>(make.builder, interest, thing);
    make.node("interest", kRootNode, interest);
    return place;
}

/// The value of a stopped animation's time was tried by nobody: the one of the frame that it wanted was.
TEST(AnimationHunt, AStoppedAnimationWhoseValueIsRefusedIsPaused) {
    Simulation simulation;
    ListMaker make;
    const ObjectId place = watchedThing(make), levels = make.create<DistanceLOD>();
    make.node("levels", kRootNode, levels);
    const ObjectId take = make.create<Animation>();
    setField<&Animation::channels>(
        make.builder, take,
        RefList{framesOf(make, place, "scale", {0, 1}, {0, 0, 0, 0, 0, 0}, KeyFrames::kLinear),
                framesOf(make, levels, "ranges", {0, 0.5}, {2, 1, 1, 2}, KeyFrames::kStep)});
    setField<&Animation::playing>(make.builder, take, true);
    setField<&Animation::time>(make.builder, take, 0.49);
    make.node("take", kRootNode, take);
    ASSERT_TRUE(simulation.load({}));
    const FrameResult made = simulation.step(true, one(make.builder.take()));
    ASSERT_TRUE(made.outcomes.front().result) << made.outcomes.front().result.error().message;
    const std::vector<std::string> remarks = simulation.step(false, {}).remarks;
    ASSERT_EQ(remarks.size(), 1u);
    EXPECT_WORDS(remarks.front());
}

std::vector<double> anyNumbers(Random& random, std::size_t count) {
    constexpr std::array kNumbers{0.0, 1.0, -1.0, 2.0, 0.5, 3.0, 1e-3, 100.0, 65536.0, 1e6, -1e9, 1e9, 1e18};
    const bool tame = oneIn(random, 2);
    std::vector<double> numbers;
    for (std::size_t i = 0; i < count; ++i) numbers.push_back(kNumbers[below(random, tame ? 6 : kNumbers.size())]);
    return numbers;
}

struct Target {
    ObjectId object;
    const TypeInfo* type = nullptr;
};

/// Key frames of one of its fields, sound as often as not.
ObjectId anyFrames(Random& random, ListMaker& make, const Target& target) {
    const FieldEntry& field = target.type->fields[below(random, target.type->fields.size())];
    std::size_t width = field.width;
    if (field.kind == FieldKind::kInt || field.kind == FieldKind::kBool) width = 1;
    if (field.kind == FieldKind::kMatrix) width = 16;
    if (field.kind == FieldKind::kBlob) width = field.numbersEach * (1 + below(random, 3));
    std::vector<double> times{0};
    while (times.size() < 4 && !oneIn(random, 3)) times.push_back(times.back() + 0.05 + 0.1 * double(below(random, 4)));
    const auto interpolation = static_cast<std::int64_t>(below(random, 3));
    const std::size_t parts = interpolation == KeyFrames::kSpline ? 3 : 1;
    return framesOf(make, target.object, field.name, times, anyNumbers(random, times.size() * parts * width),
                    interpolation);
}

TEST(AnimationHunt, OfAnyFieldToAnyValueTheServerLivesAndAReplicaFollows) {
    std::size_t held = 0, paused = 0, granted = 0;
    forSeeds(250, [&](Random& random) {
        Simulation simulation;
        ASSERT_TRUE(simulation.load({}));
        Aspect replica;
        const auto frame = [&](std::vector<Edit> edits) {
            const bool first = simulation.sequence() == Sequence();
            FrameResult result = simulation.step(first, std::move(edits));
            if (result.commit.list) {
                EXPECT_TRUE(replica.apply(*result.commit.list));
            }
            EXPECT_EQ(replica.stateHash(), simulation.scene().stateHash());
            paused += result.remarks.size();
            held += result.collision.stopped.size();
            return result;
        };
        std::vector<Target> targets;
        std::vector<ObjectId> animations;
        const auto take = [&](ListMaker& make, auto&& found) {
            FrameResult result = frame(one(make.builder.take()));
            if (result.outcomes.empty() || !result.outcomes.front().result) return;
            ++granted;
            for (const auto& [placeholder, id] : result.outcomes.front().result->ids) found(placeholder, id);
        };
        {
            ListMaker make;
            watchedThing(make);
            make.node("wall", make.node("walls", kRootNode, make.transform(Vec3d(2, 0, 0))), make.box(Vec3d(1, 4, 4)));
            take(make, [&](ObjectId, ObjectId id) { targets.push_back({id, &simulation.scene().find(id).info()}); });
        }
        for (const TypeInfo& type : allTypes()) {
            if (type.type == typeOf<KeyFrames>() || type.fields.empty() || oneIn(random, 2)) continue;
            ListMaker make;
            const ObjectId core = make.create(type.type);
            if (type.isCore && type.type != typeOf<Node>()) make.node("of", kRootNode, core);
            take(make, [&](ObjectId, ObjectId id) {
                const Object object = simulation.scene().find(id);
                targets.push_back({id, &object.info()});
                if (object.is<Animation>()) animations.push_back(id);
            });
        }
        for (int turn = 0; turn < 60 && !testing::Test::HasFailure(); ++turn) {
            ListMaker make;
            const ObjectId some = animations.empty() ? ObjectId() : animations[below(random, animations.size())];
            switch (some ? below(random, 9) : 0) {
                case 0: {
                    const ObjectId made = make.create<Animation>();
                    RefList channels;
                    for (std::size_t i = 0; i <= below(random, 4); ++i)
                        channels.push_back(anyFrames(random, make, targets[below(random, targets.size())]));
                    // One that is stopped, as often as not.
                    if (oneIn(random, 2))
                        channels.push_back(framesOf(make, targets.front().object, "scale", {0, 1}, {0, 0, 0, 1, 1, 1},
                                                    KeyFrames::kStep));
                    setField<&Animation::channels>(make.builder, made, channels);
                    setField<&Animation::playing>(make.builder, made, true);
                    setField<&Animation::mode>(make.builder, made, static_cast<std::int64_t>(below(random, 3)));
                    setField<&Animation::time>(make.builder, made, 0.05 * double(below(random, 20)));
                    take(make, [&](ObjectId placeholder, ObjectId id) {
                        if (placeholder == made) animations.push_back(id);
                    });
                    continue;
                }
                case 1:
                    setField<&Animation::playing>(make.builder, some, !oneIn(random, 3));
                    break;
                case 2:
                    setField<&Animation::time>(make.builder, some, 0.05 * double(below(random, 20)));
                    break;
                case 3:
                    setField<&Animation::speed>(make.builder, some, double(below(random, 9)) - 4);
                    break;
                case 4: {
                    const RefList& channels = simulation.scene().get<Animation>(some)->channels;
                    if (channels.empty()) continue;
                    const ObjectId frames = channels[below(random, channels.size())];
                    const std::size_t count =
                        simulation.scene().get<KeyFrames>(frames)->values.sizeBytes() / sizeof(double);
                    if (count > 0)
                        setField<&KeyFrames::values>(make.builder, frames, keyArray(anyNumbers(random, count)));
                    break;
                }
                default:
                    for (std::size_t i = 0; i <= below(random, 4); ++i) (void)frame({});
                    continue;
            }
            take(make, [](ObjectId, ObjectId) {});
        }
    });
    // It has met what it hunts.
    EXPECT_GT(granted, 1000u);
    EXPECT_GT(held, 100u);
    EXPECT_GT(paused, 100u);
}

}  // namespace
}  // namespace tessera
