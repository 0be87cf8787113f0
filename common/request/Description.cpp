#include "common/request/Description.h"

#include <cstring>

namespace tessera {

std::uint64_t integerOf(const ValueType& type, const void* value) {
    const auto as = [&]<typename T>(T held) {
        std::memcpy(&held, value, sizeof held);
        return held;
    };
    const bool isSigned = type.kind == ValueKind::kSigned;
    const auto wide = [](std::int64_t number) { return static_cast<std::uint64_t>(number); };
    switch (type.bytes) {
        case 1:
            return isSigned ? wide(as(std::int8_t{})) : as(std::uint8_t{});
        case 2:
            return isSigned ? wide(as(std::int16_t{})) : as(std::uint16_t{});
        case 4:
            return isSigned ? wide(as(std::int32_t{})) : as(std::uint32_t{});
        default:
            return as(std::uint64_t{});
    }
}

bool setInteger(const ValueType& type, void* value, std::uint64_t number) {
    bool known = true;
    if (type.kind == ValueKind::kBool)
        number = number != 0 ? 1 : 0;
    else if (type.kind == ValueKind::kWord)
        known = number < type.words.size();
    else if (type.kind == ValueKind::kSigned && type.bytes < sizeof number)
        known = number + (std::uint64_t{1} << (8 * type.bytes - 1)) < std::uint64_t{1} << (8 * type.bytes);
    else if (type.bytes < sizeof number)
        known = number >> (8 * type.bytes) == 0;
    if (!known) number = 0;
    std::memcpy(value, &number, type.bytes);  // little-endian
    return known;
}

namespace {

void addStep(std::vector<RecordStep>& steps, const RecordStep& step) {
    const auto merges = [&](const RecordStep& before) {
        return step.way == RecordStep::Way::kCopy && before.way == RecordStep::Way::kCopy &&
               before.offset + before.bytes == step.offset;
    };
    if (!steps.empty() && merges(steps.back()))
        steps.back().bytes += step.bytes;
    else
        steps.push_back(step);
}

void addSteps(std::vector<RecordStep>& steps, const MemberEntry& m) {
    using Way = RecordStep::Way;
    switch (m.held.kind) {
        case ValueKind::kBool:
            return addStep(steps, {.way = Way::kFlag, .offset = m.offset});
        case ValueKind::kWord:
            return addStep(steps, {Way::kWord, m.offset, m.held.bytes, m.held.words.size()});
        case ValueKind::kText:
            return addStep(steps, {.way = Way::kText, .offset = m.offset});
        case ValueKind::kRotation:
            return addStep(steps, {.way = Way::kRotation, .offset = m.offset});
        case ValueKind::kValue:
            for (RecordStep step : m.held.described->record) {
                step.offset += m.offset;
                addStep(steps, step);
            }
            return;
        default:
            return addStep(steps, {.way = Way::kCopy, .offset = m.offset, .bytes = m.held.bytes});
    }
}

}  // namespace

void DescriptionMaker::finish(Description& made) {
    for (const MemberEntry& m : made.members) {
        made.recordBytes += m.held.recordBytes;
        if (m.form == MemberForm::kReserved) {
            made.record.push_back({.way = RecordStep::Way::kReserved, .bytes = m.held.recordBytes});
        } else if (m.manner == Manner::kOne) {
            made.recordHasTexts = made.recordHasTexts || m.held.kind == ValueKind::kText ||
                                  (m.held.kind == ValueKind::kValue && m.held.described->recordHasTexts);
            addSteps(made.record, m);
        }
    }
}

}  // namespace tessera
