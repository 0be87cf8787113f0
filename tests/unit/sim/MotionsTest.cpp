/// Key frames between their keys; motions followed through histories, beside a look at every one of them.
#include "server/sim/frame/Motions.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <map>

#include "common/animation/MotionKeys.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/RandomTree.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

using test::ListMaker;
using test::RandomTree;

std::vector<double> keys(std::initializer_list<std::pair<double, double>> timeAndX) {
    std::vector<double> all;
    for (const auto& [t, x] : timeAndX)
        for (const double v : {t, x, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0}) all.push_back(v);
    return all;
}

TEST(Motions, InterpolateLinearlyBetweenKeysAndStandStillOutside) {
    const auto k = keys({{1, 10}, {2, 20}, {4, 0}});
    EXPECT_EQ(poseAt(k, Motion::kOnce, 0).translation.x(), 10);
    EXPECT_EQ(poseAt(k, Motion::kOnce, 1.5).translation.x(), 15);
    EXPECT_EQ(poseAt(k, Motion::kOnce, 3).translation.x(), 10);
    EXPECT_EQ(poseAt(k, Motion::kOnce, 9).translation.x(), 0);
}

TEST(Motions, LoopStartsOverAndPingPongComesBack) {
    const auto k = keys({{0, 0}, {2, 8}});
    EXPECT_DOUBLE_EQ(poseAt(k, Motion::kLoop, 2.5).translation.x(), 2);
    EXPECT_DOUBLE_EQ(poseAt(k, Motion::kPingPong, 2.5).translation.x(), 6);
    EXPECT_DOUBLE_EQ(poseAt(k, Motion::kPingPong, 4.5).translation.x(), 2);
}

TEST(Motions, RotateAlongTheShorterArc) {
    std::vector<double> k = keys({{0, 0}, {1, 0}});
    const Quatd quarter(Eigen::AngleAxisd(1.5, Vec3d::UnitY()));
    // The same rotation with the sign turned: the long way round for a naive interpolation.
    const double q[4] = {-quarter.w(), -quarter.x(), -quarter.y(), -quarter.z()};
    std::copy(q, q + 4, k.begin() + kScalarsPerKey + 4);
    const Quatd half = poseAt(k, Motion::kOnce, 0.5).rotation;
    EXPECT_NEAR(half.angularDistance(Quatd(Eigen::AngleAxisd(0.75, Vec3d::UnitY()))), 0, 1e-12);
}

TEST(Motions, ManyKeysAreAnsweredLikeFew) {
    std::vector<double> many;
    for (int i = 0; i < 1000; ++i)
        for (const double v : keys({{0.1 * i, i % 7}})) many.push_back(v);
    for (const double time : {-1.0, 0.0, 0.05, 0.1, 31.4, 99.85, 99.9, 200.0}) {
        const double at = std::clamp(time, 0.0, 99.9);
        const auto before = static_cast<std::size_t>(std::min(998.0, at / 0.1 + 1e-9));
        const std::span<const double> pair = std::span(many).subspan(before * kScalarsPerKey, 2 * kScalarsPerKey);
        EXPECT_NEAR(poseAt(many, Motion::kOnce, time).translation.x(), poseAt(pair, Motion::kOnce, at).translation.x(),
                    1e-9)
            << time;
    }
}

TEST(Motions, UnsoundKeysAreExplained) {
    EXPECT_FALSE(checkKeys({}));
    std::vector<double> k = keys({{0, 0}, {1, 1}});
    EXPECT_TRUE(checkKeys(k));
    EXPECT_WORDS(checkKeys(std::span(k).first(12)).error().message);
    std::vector<double> backwards = keys({{1, 0}, {1, 1}});
    EXPECT_WORDS(checkKeys(backwards).error().message);
    std::vector<double> nan = k;
    nan[1] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_WORDS(checkKeys(nan).error().message);
    std::vector<double> zero = k;
    zero[4] = 0;
    EXPECT_WORDS(checkKeys(zero).error().message);
}

/// Every Motion looked at, every key checked.
std::vector<MotionStep> byLookingAtAll(const Aspect& scene, double seconds) {
    std::map<ObjectId, MotionStep> byTarget;
    for (const ObjectId id : scene.ids()) {
        const Motion* motion = scene.get<Motion>(id);
        if (!motion || !motion->playing || !scene.get<Transform>(motion->target)) continue;
        const std::span<const double> all = motion->keys.as<double>();
        if (!checkKeys(all)) continue;
        double time = motion->time + seconds;
        if (motion->mode == Motion::kOnce) time = std::min(time, all[all.size() - kScalarsPerKey]);
        byTarget[motion->target] = {
            .motion = id, .target = motion->target, .time = time, .pose = poseAt(all, motion->mode, time)};
    }
    std::map<ObjectId, MotionStep> byMotion;
    for (const auto& [target, step] : byTarget) byMotion[step.motion] = step;
    std::vector<MotionStep> steps;
    for (const auto& [id, step] : byMotion) steps.push_back(step);
    return steps;
}

bool same(const MotionStep& a, const MotionStep& b) {
    return a.motion == b.motion && a.target == b.target && a.time == b.time &&
           a.pose.translation == b.pose.translation && a.pose.rotation.coeffs() == b.pose.rotation.coeffs() &&
           a.pose.scale == b.pose.scale;
}

TEST(Motions, ThoseThatPlayAreWhatALookAtAllOfThemSaysAfterAnyHistory) {
    std::size_t steps = 0, unsound = 0, shared = 0;
    forSeeds(30, [&](Random& random) {
        RandomTree tree(random);
        Motions followed;
        for (int step = 0; step < 200; ++step) {
            const ChangeListPtr list = tree.next();
            if (!list) continue;
            if (oneIn(random, 4)) (void)tree.committer.closeFrame();
            followed.update(tree.scene(), oneIn(random, 30) ? nullptr : list.get());
            const std::vector<MotionStep> right = byLookingAtAll(tree.scene(), 0.25);
            const std::vector<MotionStep> now = followed.advance(tree.scene(), 0.25);
            ASSERT_TRUE(std::equal(now.begin(), now.end(), right.begin(), right.end(), same)) << "step " << step;
            steps += now.size();

            std::map<ObjectId, std::vector<ObjectId>> playing;  // by target
            std::size_t count = 0;
            for (const ObjectId id : tree.scene().ids())
                if (const Motion* motion = tree.scene().get<Motion>(id); motion && motion->playing) {
                    ++count;
                    unsound += !checkKeys(motion->keys.as<double>());
                    playing[motion->target].push_back(id);
                }
            ASSERT_EQ(followed.playingCount(), count);
            for (const auto& [target, motions] : playing) {
                std::vector<ObjectId> told;
                followed.appendPlaying(target, told);
                ASSERT_EQ(told, motions) << "step " << step;
                shared += motions.size() > 1;
            }
        }
    });
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(steps, 1000u);
    EXPECT_GT(unsound, 100u);
    EXPECT_GT(shared, 100u);
}

TEST(Motions, KeysAreCheckedOnceWhenTheyChange) {
    Committer committer;
    ListMaker make;
    std::vector<ObjectId> ids;
    for (int i = 0; i < 100; ++i)
        ids.push_back(make.motion(make.transform(Vec3d::Zero()), {{0, 0, 0, 0}, {1, 6, 0, 0}}));
    const Committer::Applied made = committer.apply(make.builder.take()).value();
    Motions motions;
    motions.update(committer.scene(), made.list.get());
    EXPECT_EQ(motions.keysChecked(), 100u);
    for (int frame = 0; frame < 50; ++frame) EXPECT_EQ(motions.advance(committer.scene(), 0.1).size(), 100u);
    EXPECT_EQ(motions.keysChecked(), 100u) << "not by frames";

    ChangeListBuilder pause;
    for (const auto& [placeholder, id] : made.ids)
        if (committer.scene().get<Motion>(id)) pause.set(id, typeOf<Motion>(), fieldId<&Motion::playing>, false);
    const ChangeListPtr paused = committer.apply(pause.take()).value().list;
    motions.update(committer.scene(), paused.get());
    EXPECT_EQ(motions.playingCount(), 0u);
    EXPECT_TRUE(motions.advance(committer.scene(), 0.1).empty());
    EXPECT_EQ(motions.keysChecked(), 100u) << "not by what else is said of motions";
    motions.update(committer.scene(), nullptr);
    EXPECT_EQ(motions.keysChecked(), 200u) << "a fresh start checks them";
}

}  // namespace
}  // namespace tessera
