/// Two steps that say the same, work and bits included.
#pragma once

#include <gtest/gtest.h>

#include "server/collision/pipeline/StepResult.h"

namespace tessera {

inline void expectEqual(const StepResult& x, const StepResult& y) {
    ASSERT_EQ(x.accepted.size(), y.accepted.size());
    for (std::size_t i = 0; i < x.accepted.size(); ++i) {
        EXPECT_EQ(x.accepted[i].transform, y.accepted[i].transform);
        EXPECT_EQ(x.accepted[i].translation, y.accepted[i].translation);
        EXPECT_EQ(x.accepted[i].rotation.coeffs(), y.accepted[i].rotation.coeffs());
    }
    ASSERT_EQ(x.velocities.size(), y.velocities.size());
    for (std::size_t i = 0; i < x.velocities.size(); ++i) EXPECT_EQ(x.velocities[i].velocity, y.velocities[i].velocity);
    EXPECT_EQ(x.stopped, y.stopped);
    ASSERT_EQ(x.contacts.size(), y.contacts.size());
    for (std::size_t i = 0; i < x.contacts.size(); ++i) {
        EXPECT_EQ(x.contacts[i].objectA, y.contacts[i].objectA);
        EXPECT_EQ(x.contacts[i].objectB, y.contacts[i].objectB);
        EXPECT_EQ(x.contacts[i].faceA, y.contacts[i].faceA);
        EXPECT_EQ(x.contacts[i].faceB, y.contacts[i].faceB);
        EXPECT_EQ(x.contacts[i].point, y.contacts[i].point);
        EXPECT_EQ(x.contacts[i].normal, y.contacts[i].normal);
        EXPECT_EQ(x.contacts[i].time, y.contacts[i].time);
    }
    ASSERT_EQ(x.events.size(), y.events.size());
    for (std::size_t i = 0; i < x.events.size(); ++i) {
        EXPECT_EQ(x.events[i].interest, y.events[i].interest);
        EXPECT_EQ(x.events[i].objectA, y.events[i].objectA);
        EXPECT_EQ(x.events[i].objectB, y.events[i].objectB);
        EXPECT_EQ(x.events[i].phase, y.events[i].phase);
        EXPECT_EQ(x.events[i].firstTime, y.events[i].firstTime);
    }
    ASSERT_EQ(x.distances.size(), y.distances.size());
    for (std::size_t i = 0; i < x.distances.size(); ++i) EXPECT_EQ(x.distances[i].distance, y.distances[i].distance);
    ASSERT_EQ(x.questions.size(), y.questions.size());
    for (std::size_t i = 0; i < x.questions.size(); ++i) {
        EXPECT_EQ(x.questions[i].id, y.questions[i].id);
        EXPECT_EQ(x.questions[i].transform, y.questions[i].transform);
    }
    ASSERT_EQ(x.notLookedAt.size(), y.notLookedAt.size());
    for (std::size_t i = 0; i < x.notLookedAt.size(); ++i) {
        EXPECT_EQ(x.notLookedAt[i].nodeA, y.notLookedAt[i].nodeA);
        EXPECT_EQ(x.notLookedAt[i].nodeB, y.notLookedAt[i].nodeB);
        EXPECT_EQ(x.notLookedAt[i].reason, y.notLookedAt[i].reason);
    }
    EXPECT_EQ(x.contactsBegun, y.contactsBegun);
    EXPECT_EQ(x.counters.pairsTested, y.counters.pairsTested);
    EXPECT_EQ(x.counters.boxTests, y.counters.boxTests);
    EXPECT_EQ(x.counters.triangleTests, y.counters.triangleTests);
    EXPECT_EQ(x.counters.asleep, y.counters.asleep);
    EXPECT_EQ(x.counters.notLookedAt, y.counters.notLookedAt);
}

}  // namespace tessera
