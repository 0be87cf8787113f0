/// Values of ApplicationCollision.h as arrays of records of fixed size, little-endian: the parts behind the small
/// heads.
#pragma once

#include <span>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/codec/ApplicationCollision.h"

namespace tessera {

inline constexpr std::size_t kContactBytes = 176, kPairEventBytes = 88, kPairDistanceBytes = 120, kQuestionBytes = 248;

[[nodiscard]] Bytes packContacts(std::span<const ContactValue> contacts);
[[nodiscard]] Bytes packEvents(std::span<const PairEventValue> events);
[[nodiscard]] Bytes packDistances(std::span<const PairDistanceValue> distances);
[[nodiscard]] Bytes packQuestions(std::span<const QuestionValue> questions);

/// At most `most` entries, counted before memory is taken (kLimit). kBadInput: a broken entry, numbers that are not
/// finite, times outside a frame, phases and flags that do not exist, distances below zero, rotations of no length.
[[nodiscard]] Expected<std::vector<ContactValue>> unpackContacts(ByteSpan bytes, std::size_t most);
[[nodiscard]] Expected<std::vector<PairEventValue>> unpackEvents(ByteSpan bytes, std::size_t most);
[[nodiscard]] Expected<std::vector<PairDistanceValue>> unpackDistances(ByteSpan bytes, std::size_t most);
[[nodiscard]] Expected<std::vector<QuestionValue>> unpackQuestions(ByteSpan bytes, std::size_t most);

}  // namespace tessera
