#include "common/animation/KeyTrack.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "common/scene/WrittenByServer.h"

namespace tessera {
namespace {

tl::unexpected<Error> bad(std::string why) {
    return fail(ErrorCode::kBadInput, std::move(why));
}

/// How many numbers a key of this field has; 0: as many as its array has. Nothing: no numbers say it.
std::optional<std::size_t> numbersOf(const FieldInfo& field) {
    switch (field.kind) {
        case FieldKind::kFloat:
        case FieldKind::kDouble:
            return field.width;
        case FieldKind::kInt:
        case FieldKind::kBool:
            return 1;
        case FieldKind::kMatrix:
            return 16;
        case FieldKind::kBlob:
            return field.numbersEach > 0 ? std::optional<std::size_t>(0) : std::nullopt;
        case FieldKind::kRef:
        case FieldKind::kRefs:
        case FieldKind::kText:
            break;
    }
    return std::nullopt;
}

bool stepsOnly(const FieldInfo& field) {
    return field.kind == FieldKind::kInt || field.kind == FieldKind::kBool;
}

Quatd turnOf(std::span<const double> wxyz) {
    return Quatd(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized();
}

std::vector<double> numbersOf(const Quatd& turn) {
    return {turn.w(), turn.x(), turn.y(), turn.z()};
}

/// Times are sums of sixtieths, and keys come as floats from files: what steps at a frame does so in that frame.
/// Relative, from a second on.
constexpr double kRounding = 1e-7;

constexpr double kGreatestFloat = std::numeric_limits<float>::max();

FieldValue packedValue(const FieldInfo& field, std::span<const double> numbers, bool broughtWithinBounds) {
    const auto within = [&](double number) {
        return broughtWithinBounds ? std::clamp(number, field.least, field.greatest) : number;
    };
    switch (field.kind) {
        case FieldKind::kFloat: {
            Floats value;
            value.width = field.width;
            for (std::size_t i = 0; i < field.width; ++i)
                value.values[i] = static_cast<float>(std::clamp(within(numbers[i]), -kGreatestFloat, kGreatestFloat));
            return value;
        }
        case FieldKind::kDouble: {
            Doubles value;
            value.width = field.width;
            for (std::size_t i = 0; i < field.width; ++i) value.values[i] = within(numbers[i]);
            return value;
        }
        case FieldKind::kInt:
            return static_cast<std::int64_t>(numbers[0]);
        case FieldKind::kBool:
            return numbers[0] != 0;
        case FieldKind::kMatrix: {
            Matrix value;
            std::ranges::copy(numbers.first(16), value.values.begin());
            return value;
        }
        case FieldKind::kBlob: {
            if (field.doubles) return Blob::of(numbers);
            std::vector<float> floats;
            for (const double number : numbers)
                floats.push_back(static_cast<float>(std::clamp(number, -kGreatestFloat, kGreatestFloat)));
            return Blob::of(std::span<const float>(floats));
        }
        case FieldKind::kRef:
        case FieldKind::kRefs:
        case FieldKind::kText:
            break;
    }
    return FieldValue();
}

}  // namespace

bool isBlank(const KeyFrames& frames) {
    return frames.times.empty() && frames.values.empty();
}

KeyTrack KeyTrack::ofSound(const KeyFrames& frames, const TypeInfo& target) {
    KeyTrack track;
    track.type_ = &target;
    track.field_ = findField(target, frames.field);
    track.times_ = frames.times.as<double>();
    track.values_ = frames.values.as<double>();
    track.interpolation_ = frames.interpolation;
    const std::size_t parts = frames.interpolation == KeyFrames::kSpline ? 3 : 1;
    if (!track.times_.empty()) track.numbers_ = track.values_.size() / track.times_.size() / parts;
    return track;
}

Expected<KeyTrack> KeyTrack::of(const KeyFrames& frames, const TypeInfo* target) {
    if (!target) return bad("the key frames have no target");
    if (frames.field.empty())
        return bad(fmt::format("the key frames name no field of their target, a {}", target->name));
    const FieldEntry* field = findField(*target, frames.field);
    if (!field) return bad(fmt::format("a {} has no field '{}'", target->name, frames.field));
    const std::optional<std::size_t> wanted = numbersOf(*field);
    if (!wanted)
        return bad(
            fmt::format("{}'s {} is {}: key frames have numbers", target->name, field->name, nameOf(field->kind)));
    if (typeOf<KeyFrames>() == target->type) return bad("key frames cannot drive key frames");
    if (const FieldOfServer* of = fieldOfServer(target->type, field->id); of != nullptr && !of->anew)
        return bad(fmt::format("{}'s {} is what the server says of it", target->name, field->name));
    for (const Blob* blob : {&frames.times, &frames.values}) {
        if (!blob->empty() && !blob->resident()) return bad("an array of the key frames is not here");
        if (blob->sizeBytes() % sizeof(double) != 0)
            return bad(fmt::format("{} bytes of {} are no whole number of doubles", blob->sizeBytes(),
                                   blob == &frames.times ? "times" : "values"));
    }
    const KeyTrack track = ofSound(frames, *target);
    const std::span<const double> times = track.times_;
    if (times.empty()) return bad("the key frames have no keys");
    for (std::size_t i = 0; i < times.size(); ++i) {
        if (!(std::abs(times[i]) <= kLatestKeySeconds))
            return bad(fmt::format("key {} is at {} s: times are numbers within {:g}", i, times[i], kLatestKeySeconds));
        if (i > 0 && !(times[i] > times[i - 1])) return bad(fmt::format("key {} is not later than the one before", i));
    }
    const std::size_t parts = frames.interpolation == KeyFrames::kSpline ? 3 : 1;
    const std::size_t count = track.values_.size(), keys = times.size() * parts;
    if (*wanted > 0 ? count != keys * *wanted : count == 0 || count % (keys * field->numbersEach) != 0)
        return bad(fmt::format("{} numbers are not {} keys of {}{}, each of {}{}", count, times.size(),
                               *wanted > 0 ? std::string() : "any number of times ",
                               *wanted > 0 ? *wanted : std::size_t{field->numbersEach}, field->name,
                               parts == 3 ? " (times three: spline)" : ""));
    if (const Expected<void> sound = track.checkNumbers(); !sound) return tl::unexpected(sound.error());
    return track;
}

Expected<void> KeyTrack::checkNumbers() const {
    const bool spline = interpolation_ == KeyFrames::kSpline;
    for (std::size_t i = 0; i < values_.size(); ++i)
        if (!std::isfinite(values_[i]))
            return bad(fmt::format("key {} holds a number that is not finite", i / (numbers_ * (spline ? 3 : 1))));
    const bool floats = field_->kind == FieldKind::kFloat || (field_->kind == FieldKind::kBlob && !field_->doubles);
    for (std::size_t key = 0; key < times_.size(); ++key) {
        const std::span<const double> value = part(key, spline ? 1 : 0);
        for (const double number : value) {
            if (floats && std::abs(number) > kGreatestFloat)
                return bad(fmt::format("key {} holds {}, more than a float can", key, number));
            if (stepsOnly(*field_) && (std::trunc(number) != number || std::abs(number) > 9e15))
                return bad(fmt::format("key {} is {}: {} holds whole numbers", key, number, field_->name));
            if (field_->kind == FieldKind::kBool && number != 0 && number != 1)
                return bad(fmt::format("key {} is {}: {} is 0 or 1", key, number, field_->name));
        }
        if (field_->kind == FieldKind::kBlob) continue;
        if (const Expected<void> holds = checkValue(*field_, packedValue(*field_, value, false)); !holds)
            return failWith(fmt::format("key {}", key), holds.error());
    }
    return {};
}

std::span<const double> KeyTrack::part(std::size_t key, std::size_t which) const {
    const std::size_t parts = interpolation_ == KeyFrames::kSpline ? 3 : 1;
    return values_.subspan((key * parts + which) * numbers_, numbers_);
}

std::vector<double> KeyTrack::at(double seconds) const {
    const bool spline = interpolation_ == KeyFrames::kSpline;
    const auto key = [&](std::size_t i) {
        const std::span<const double> numbers = part(i, spline ? 1 : 0);
        return std::vector<double>(numbers.begin(), numbers.end());
    };
    const bool steps = interpolation_ == KeyFrames::kStep || stepsOnly(*field_);
    const double reached = steps ? seconds + kRounding * (1 + std::abs(seconds)) : seconds;
    const auto after =
        static_cast<std::size_t>(std::upper_bound(times_.begin(), times_.end(), reached) - times_.begin());
    if (after == 0) return key(0);
    const std::size_t before = after - 1;
    if (after == times_.size() || steps) return key(before);
    const double span = times_[after] - times_[before];
    const double t = (seconds - times_[before]) / span;
    if (!spline) {
        const std::span<const double> a = part(before, 0), b = part(after, 0);
        if (field_->quaternion) return numbersOf(turnOf(a).slerp(t, turnOf(b)));
        std::vector<double> numbers(numbers_);
        for (std::size_t i = 0; i < numbers_; ++i) numbers[i] = (1 - t) * a[i] + t * b[i];
        return numbers;
    }
    const std::span<const double> a = part(before, 1), leadsOut = part(before, 2), leadsIn = part(after, 0),
                                  b = part(after, 1);
    const double t2 = t * t, t3 = t2 * t;
    std::vector<double> numbers(numbers_);
    for (std::size_t i = 0; i < numbers_; ++i) {
        numbers[i] = (2 * t3 - 3 * t2 + 1) * a[i] + span * (t3 - 2 * t2 + t) * leadsOut[i] + (-2 * t3 + 3 * t2) * b[i] +
                     span * (t3 - t2) * leadsIn[i];
        if (!std::isfinite(numbers[i])) return key(before);
    }
    if (!field_->quaternion) return numbers;
    double squared = 0;
    for (const double number : numbers) squared += number * number;
    // Where the curve passes through nothing, the turn before it stays.
    return tellsRotation(squared) ? numbersOf(turnOf(numbers)) : key(before);
}

FieldValue KeyTrack::valueOf(std::span<const double> numbers) const {
    return packedValue(*field_, numbers, true);
}

double foldedTime(double seconds, double last, std::int64_t mode) {
    if (!(last > 0) || !std::isfinite(seconds)) return 0;
    if (mode == Animation::kOnce) return std::clamp(seconds, 0.0, last);
    const double length = mode == Animation::kPingPong ? 2 * last : last;
    // A seek to the end shows the end.
    const double phase = seconds >= 0 && seconds <= length ? seconds : std::fmod(seconds, length);
    return std::min(phase < 0 ? phase + length : phase, kLatestKeySeconds);
}

double shownTime(double folded, double last, std::int64_t mode) {
    return mode == Animation::kPingPong && folded > last ? 2 * last - folded : folded;
}

}  // namespace tessera
