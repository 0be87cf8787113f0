/// The key frames of one field, checked and read at any time: KeyFrames (common/cores/Animation.h) with its target's
/// type.
///
/// Between keys as glTF 2.0's appendix C, "Interpolation Algorithms", has it: the earlier key's value (kStep); straight
/// lines, of quaternions slerp along the shorter arc (kLinear); cubic Hermite splines with the tangents of the keys, of
/// quaternions brought to length one (kSpline).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/cores/Animation.h"
#include "common/scene/FieldTable.h"

namespace tessera {

/// No key is before, none after.
inline constexpr double kLatestKeySeconds = 1e9;

/// Looks at key frames where they lie: holds as long as their blobs.
class KeyTrack {
public:
    /// Refused in words: no target or field, a field that the type does not have or that no numbers say; no keys; times
    /// that do not ascend, are no numbers or beyond kLatestKeySeconds; values of another count than keys and field
    /// want, that are no numbers, or that the field cannot hold (of splines the values at keys: between them they are
    /// brought within the field's bounds). Costs a look at every number.
    [[nodiscard]] static Expected<KeyTrack> of(const KeyFrames& frames, const TypeInfo* target);
    /// The same of frames that have passed it, without a look at the numbers.
    [[nodiscard]] static KeyTrack ofSound(const KeyFrames& frames, const TypeInfo& target);

    [[nodiscard]] const TypeInfo& type() const { return *type_; }
    [[nodiscard]] const FieldEntry& field() const { return *field_; }
    /// How many a key has: of an array all of its numbers.
    [[nodiscard]] std::size_t numbers() const { return numbers_; }
    [[nodiscard]] double lastTime() const { return times_.back(); }

    /// All numbers of the field, quaternions as w x y z; of whole numbers and flags the whole number. What steps does
    /// so up to 0.1 µs (of later times their 1e-7th) before its key: within the rounding of times.
    [[nodiscard]] std::vector<double> at(double seconds) const;
    /// The same as a value of the field; of arrays as floats or doubles in a blob.
    [[nodiscard]] FieldValue valueAt(double seconds) const { return valueOf(at(seconds)); }
    [[nodiscard]] FieldValue valueOf(std::span<const double> numbers) const;

private:
    [[nodiscard]] std::span<const double> part(std::size_t key, std::size_t which) const;
    [[nodiscard]] Expected<void> checkNumbers() const;

    const TypeInfo* type_ = nullptr;
    const FieldEntry* field_ = nullptr;
    std::span<const double> times_, values_;
    std::size_t numbers_ = 0;
    std::int64_t interpolation_ = KeyFrames::kLinear;
};

/// Whether nothing has been said yet: neither refused nor played.
[[nodiscard]] bool isBlank(const KeyFrames& frames);

/// An animation's own time folded into what it shows, and what it is kept as: of length `last` (s, not below 0). kOnce
/// and kLoop: from 0 to `last`; kPingPong: from 0 to 2 `last`, the second half on the way back. A length of 0 is always
/// at 0. Never beyond kLatestKeySeconds, as far as Animation::time goes: a longer way back ends there.
[[nodiscard]] double foldedTime(double seconds, double last, std::int64_t mode);
/// The time of the keys that are shown at a folded time.
[[nodiscard]] double shownTime(double folded, double last, std::int64_t mode);

}  // namespace tessera
