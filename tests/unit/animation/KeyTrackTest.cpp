/// Key frames beside glTF 2.0's appendix C in long double, key by key; what is refused, in words; times folded.
#include "common/animation/KeyTrack.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <tuple>

#include "tests/property/Seeds.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

KeyFrames framesOf(std::string field, std::vector<double> times, std::vector<double> values,
                   std::int64_t interpolation = KeyFrames::kLinear) {
    return {.target = ObjectId(7),
            .field = std::move(field),
            .times = Blob::of(std::span<const double>(times)),
            .values = Blob::of(std::span<const double>(values)),
            .interpolation = interpolation};
}

const TypeInfo& typeCalled(std::string_view name) {
    return *findType(name);
}

std::string refusal(const KeyFrames& frames, const TypeInfo* type) {
    const Expected<KeyTrack> track = KeyTrack::of(frames, type);
    return track ? "taken" : track.error().message;
}

double uniform(Random& random, double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
}

/// glTF 2.0, appendix C, a number at a time, found by walking along the keys.
std::vector<long double> byTheBook(const std::vector<double>& times, const std::vector<double>& values,
                                   std::int64_t interpolation, std::size_t width, bool quaternion, double at) {
    const std::size_t parts = interpolation == KeyFrames::kSpline ? 3 : 1;
    const auto number = [&](std::size_t key, std::size_t part, std::size_t i) {
        return static_cast<long double>(values[(key * parts + part) * width + i]);
    };
    const std::size_t middle = parts == 3 ? 1 : 0;
    std::vector<long double> out(width);
    std::size_t key = 0;
    while (key + 1 < times.size() && times[key + 1] <= at) ++key;
    const bool outside = at < times.front() || key + 1 == times.size();
    for (std::size_t i = 0; i < width; ++i) out[i] = number(key, middle, i);
    if (outside || interpolation == KeyFrames::kStep) return out;
    const long double td = static_cast<long double>(times[key + 1]) - static_cast<long double>(times[key]);
    const long double t = (static_cast<long double>(at) - static_cast<long double>(times[key])) / td;
    long double length = 0;
    if (parts == 3) {
        for (std::size_t i = 0; i < width; ++i) {
            out[i] = (2 * t * t * t - 3 * t * t + 1) * number(key, 1, i) +
                     td * (t * t * t - 2 * t * t + t) * number(key, 2, i) +
                     (-2 * t * t * t + 3 * t * t) * number(key + 1, 1, i) +
                     td * (t * t * t - t * t) * number(key + 1, 0, i);
            length += out[i] * out[i];
        }
        for (std::size_t i = 0; quaternion && i < width; ++i) out[i] /= std::sqrt(length);
        return out;
    }
    if (!quaternion) {
        for (std::size_t i = 0; i < width; ++i) out[i] = number(key, 0, i) * (1 - t) + number(key + 1, 0, i) * t;
        return out;
    }
    long double dot = 0, a2 = 0, b2 = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        dot += number(key, 0, i) * number(key + 1, 0, i);
        a2 += number(key, 0, i) * number(key, 0, i);
        b2 += number(key + 1, 0, i) * number(key + 1, 0, i);
    }
    dot /= std::sqrt(a2) * std::sqrt(b2);
    const long double angle = std::acos(std::min(1.0L, std::abs(dot))), sign = dot < 0 ? -1 : 1;
    for (std::size_t i = 0; i < 4; ++i) {
        const long double a = number(key, 0, i) / std::sqrt(a2), b = number(key + 1, 0, i) / std::sqrt(b2);
        out[i] = angle < 1e-9L ? a : (std::sin((1 - t) * angle) * a + sign * std::sin(t * angle) * b) / std::sin(angle);
    }
    return out;
}

TEST(KeyTrack, SaysWhatTheFormulasSayAtAnyTime) {
    forSeeds(300, [](Random& random) {
        const bool quaternion = oneIn(random, 3);
        const std::int64_t interpolation = static_cast<std::int64_t>(below(random, 3));
        const std::size_t width = quaternion ? 4 : 3, keys = 1 + below(random, 6),
                          parts = interpolation == KeyFrames::kSpline ? 3 : 1;
        std::vector<double> times, values;
        double time = uniform(random, 0, 2);
        for (std::size_t i = 0; i < keys; ++i) times.push_back(time), time += uniform(random, 1e-3, 2);
        for (std::size_t i = 0; i < keys * parts * width; ++i)
            values.push_back(uniform(random, -1, 1) + (i % 4 == 0 ? 1.5 : 0));
        const KeyFrames frames = framesOf(quaternion ? "rotation" : "translation", times, values, interpolation);
        const Expected<KeyTrack> track = KeyTrack::of(frames, &typeCalled("Transform"));
        ASSERT_TRUE(track) << track.error().message;
        EXPECT_EQ(track->lastTime(), times.back());
        for (int i = 0; i < 30; ++i) {
            const double at = i < static_cast<int>(keys) ? times[static_cast<std::size_t>(i)]
                                                         : uniform(random, times.front() - 1, times.back() + 1);
            std::vector<long double> right = byTheBook(times, values, interpolation, width, quaternion, at);
            const std::vector<double> now = track->at(at);
            long double same = 0, opposite = 0, norm = 0;
            for (std::size_t c = 0; c < width; ++c) {
                same = std::max(same, std::abs(right[c] - static_cast<long double>(now[c])));
                opposite = std::max(opposite, std::abs(right[c] + static_cast<long double>(now[c])));
                norm += right[c] * right[c];
            }
            // At a key a quaternion stands as it was said; else it has length one. Rounding: slerp's angle near 0 loses
            // half the digits.
            ASSERT_LT(quaternion ? std::min(same, opposite) : same, 1e-7L * std::max(1.0L, std::sqrt(norm)))
                << "at " << at << " kind " << interpolation;
        }
    });
}

TEST(KeyTrack, AnyFieldOfNumbersCanBeDrivenAndSteppedWhereItIsWhole) {
    const auto at = [](const char* type, const char* field, std::vector<double> values, double time) {
        const KeyFrames frames = framesOf(field, {0, 1}, std::move(values));
        const Expected<KeyTrack> track = KeyTrack::of(frames, &typeCalled(type));
        EXPECT_TRUE(track) << track.error().message;
        return track->valueAt(time);
    };
    EXPECT_EQ(std::get<Floats>(at("PointLight", "intensity", {1, 3}, 0.5)).values[0], 2.0f);
    EXPECT_EQ(std::get<std::int64_t>(at("Switch", "choice", {-1, 4}, 0.99)), -1);
    EXPECT_EQ(std::get<std::int64_t>(at("Switch", "choice", {-1, 4}, 1.0)), 4);
    EXPECT_EQ(std::get<bool>(at("Camera", "enabled", {0, 1}, 0.99)), false);
    EXPECT_EQ(std::get<bool>(at("Camera", "enabled", {0, 1}, 1.5)), true);
    const Blob weights = std::get<Blob>(at("Skin", "weights", {0, 1, 2, 3}, 0.5));
    ASSERT_EQ(weights.sizeBytes(), 8u);
    EXPECT_EQ(weights.as<float>()[0], 1.0f);
    EXPECT_EQ(weights.as<float>()[1], 2.0f);
}

/// As frames add their times up, and as files hold the times of keys.
TEST(KeyTrack, WhatStepsAtAFrameDoesSoInThatFrame) {
    constexpr std::size_t kFrames = 6'000;
    std::vector<double> exact, floats, values;
    for (std::size_t frame = 0; frame < kFrames; ++frame) {
        exact.push_back(static_cast<double>(frame) / 60);
        floats.push_back(static_cast<double>(static_cast<float>(exact.back())));
        values.push_back(static_cast<double>(frame));
    }
    for (const auto& times : {exact, floats})
        for (const auto& [type, field, interpolation] : {std::tuple("PointLight", "intensity", KeyFrames::kStep),
                                                         std::tuple("Switch", "choice", KeyFrames::kLinear)}) {
            const KeyFrames frames = framesOf(field, times, values, interpolation);
            const Expected<KeyTrack> track = KeyTrack::of(frames, &typeCalled(type));
            ASSERT_TRUE(track) << track.error().message;
            double now = 0;
            for (std::size_t frame = 0; frame < kFrames; ++frame, now += 1.0 / 60) {
                ASSERT_EQ(track->at(now)[0], static_cast<double>(frame)) << field;
                if (frame > 0) ASSERT_EQ(track->at(now - 1e-4)[0], static_cast<double>(frame - 1)) << "and not before";
            }
        }
}

TEST(KeyTrack, ASplineThatSwingsBeyondTheFieldsBoundsIsBroughtBackToThem) {
    const KeyFrames frames = framesOf("range", {0, 1}, {0, 0.5, -90, 90, 0.5, 0}, KeyFrames::kSpline);
    const Expected<KeyTrack> track = KeyTrack::of(frames, &typeCalled("PointLight"));
    ASSERT_TRUE(track) << track.error().message;
    const FieldEntry& field = track->field();
    bool swings = false;
    for (double t = 0; t <= 1; t += 0.01) {
        const FieldValue value = track->valueAt(t);
        EXPECT_TRUE(checkValue(field, value)) << t;
        swings = swings || track->at(t)[0] < field.least;
    }
    EXPECT_TRUE(swings) << "or this test says nothing";
}

TEST(KeyTrack, ASplineThatPassesThroughNoTurnKeepsTheOneBefore) {
    const KeyFrames frames =
        framesOf("rotation", {0, 1}, {0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, -1, 0, 0, 0, 0, 0, 0, 0},
                 KeyFrames::kSpline);
    const Expected<KeyTrack> track = KeyTrack::of(frames, &typeCalled("Transform"));
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_EQ(track->at(0.5), (std::vector<double>{1, 0, 0, 0}));
}

TEST(KeyTrack, WhatIsUnsoundIsRefusedInItsOwnWords) {
    const TypeInfo* transform = &typeCalled("Transform");
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    const auto good = framesOf("translation", {0, 1}, {0, 0, 0, 1, 1, 1});
    EXPECT_EQ(refusal(good, transform), "taken");
    EXPECT_WORDS(refusal(good, nullptr));
    EXPECT_WORDS(refusal(framesOf("", {0}, {0}), transform));
    EXPECT_WORDS(refusal(framesOf("colour", {0}, {0}), transform));
    EXPECT_WORDS(refusal(framesOf("name", {0}, {0}), &typeCalled("Node")));
    EXPECT_WORDS(refusal(framesOf("core", {0}, {0}), &typeCalled("Node")));
    EXPECT_WORDS(refusal(framesOf("interpolation", {0}, {0}), &typeCalled("KeyFrames")));
    EXPECT_WORDS(refusal(framesOf("translation", {}, {0, 0, 0}), transform));
    EXPECT_WORDS(refusal(framesOf("translation", {0, 0}, {0, 0, 0, 1, 1, 1}), transform));
    EXPECT_WORDS(refusal(framesOf("translation", {1, 0.5}, {0, 0, 0, 1, 1, 1}), transform));
    EXPECT_WORDS(refusal(framesOf("translation", {nan}, {0, 0, 0}), transform));
    EXPECT_WORDS(refusal(framesOf("translation", {0, 1e10}, {0, 0, 0, 1, 1, 1}), transform));
    EXPECT_WORDS(refusal(framesOf("translation", {infinity}, {0, 0, 0}), transform));
    EXPECT_WORDS(refusal(framesOf("translation", {0, 1}, {0, 0, 0, 1, 1}), transform));
    EXPECT_WORDS(refusal(framesOf("translation", {0, 1}, {0, 0, 0, 1, 1, 1}, KeyFrames::kSpline), transform));
    EXPECT_WORDS(refusal(framesOf("translation", {0}, {0, nan, 0}), transform));
    EXPECT_WORDS(refusal(framesOf("rotation", {0}, {0, 0, 0, 0}), transform));
    EXPECT_WORDS(refusal(framesOf("range", {0}, {-7}), &typeCalled("PointLight")));
    EXPECT_WORDS(refusal(framesOf("choice", {0}, {0.5}), &typeCalled("Switch")));
    EXPECT_WORDS(refusal(framesOf("enabled", {0}, {2}), &typeCalled("Camera")));
    EXPECT_WORDS(refusal(framesOf("intensity", {0}, {1e300}), &typeCalled("PointLight")));
    EXPECT_WORDS(refusal(framesOf("pose", {0}, {1, 2, 3}), &typeCalled("Skin")));
    KeyFrames odd = good;
    odd.times = Blob(Bytes(9));
    EXPECT_WORDS(refusal(odd, transform));
    odd.times = Blob::absent(good.times.id(), 16);
    EXPECT_WORDS(refusal(odd, transform));
    EXPECT_TRUE(isBlank(KeyFrames()));
    EXPECT_FALSE(isBlank(good));
}

TEST(KeyTrack, TimesFoldIntoOneLengthWhateverTheyAre) {
    EXPECT_EQ(foldedTime(2.5, 2, Animation::kOnce), 2);
    EXPECT_EQ(foldedTime(-1, 2, Animation::kOnce), 0);
    EXPECT_EQ(foldedTime(2.5, 2, Animation::kLoop), 0.5);
    EXPECT_EQ(foldedTime(2, 2, Animation::kLoop), 2) << "a seek to the end shows the end";
    EXPECT_EQ(foldedTime(-0.5, 2, Animation::kLoop), 1.5);
    EXPECT_EQ(shownTime(foldedTime(2.5, 2, Animation::kPingPong), 2, Animation::kPingPong), 1.5);
    EXPECT_EQ(shownTime(foldedTime(4.5, 2, Animation::kPingPong), 2, Animation::kPingPong), 0.5);
    EXPECT_EQ(shownTime(foldedTime(-0.5, 2, Animation::kPingPong), 2, Animation::kPingPong), 0.5);
    for (const double late : {1.5e9, -0.5})
        EXPECT_LE(foldedTime(late, kLatestKeySeconds, Animation::kPingPong), kLatestKeySeconds)
            << "the field of an Animation holds it";
    forSeeds(200, [](Random& random) {
        const double last = std::exp(uniform(random, -30, 20)),
                     time = uniform(random, -1, 1) * std::exp(uniform(random, -30, 20));
        for (const std::int64_t mode : {Animation::kOnce, Animation::kLoop, Animation::kPingPong}) {
            const double folded = foldedTime(time, last, mode), shown = shownTime(folded, last, mode);
            ASSERT_GE(folded, 0) << time << " in " << last;
            ASSERT_LE(folded, mode == Animation::kPingPong ? 2 * last : last);
            ASSERT_GE(shown, 0);
            ASSERT_LE(shown, last);
            ASSERT_EQ(foldedTime(folded, last, mode), folded) << "folded is folded";
        }
    });
    for (const double odd :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
        EXPECT_TRUE(std::isfinite(foldedTime(odd, 2, Animation::kLoop)));
        EXPECT_EQ(foldedTime(odd, 0, Animation::kLoop), 0);
    }
}

}  // namespace
}  // namespace tessera
