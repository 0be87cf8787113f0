/// Any described value, within the bounds of its description.
#pragma once

#include <algorithm>
#include <random>

#include "common/request/Description.h"

namespace tessera {

class RandomMembers {
public:
    explicit RandomMembers(std::uint64_t seed) : random_(seed) {}

    void fill(const Description& of, void* value) {
        for (const MemberEntry& m : of.members)
            if (m.form != MemberForm::kReserved && m.form != MemberForm::kRest && of.calledFor(m, value))
                some(m, m.in(value));
    }
    std::uint64_t below(std::uint64_t bound) { return random_() % bound; }

private:
    void some(const MemberEntry& m, void* member) {
        if (m.manner == Manner::kOne) return one(m, m.held, member);
        m.holder.resize(member, 0);
        for (std::uint64_t i = below(m.manner == Manner::kMany ? 4 : 2); i > 0; --i) one(m, m.held, m.add(member));
    }
    void one(const MemberEntry& m, const ValueType& type, void* value) {
        static constexpr std::string_view kTexts[] = {"", "/hall/crane", "\"quoted\"\n", "größe", "$", "#"};
        switch (type.kind) {
            case ValueKind::kBool:
                setInteger(type, value, below(2));
                return;
            case ValueKind::kWord:
                setInteger(type, value, below(type.words.size()));
                return;
            case ValueKind::kUnsigned:
            case ValueKind::kSigned:
                integer(m, type, value);
                return;
            case ValueKind::kText:
                *static_cast<std::string*>(value) = kTexts[below(std::size(kTexts))];
                return;
            case ValueKind::kNumber:
            case ValueKind::kPlace:
            case ValueKind::kVector:
                for (std::size_t i = 0; i < type.bytes / sizeof(double); ++i)
                    static_cast<double*>(value)[i] = number(m);
                return;
            case ValueKind::kRotation:
                *static_cast<Quatd*>(value) = Quatd(number(m), 1, number(m), number(m));
                return;
            case ValueKind::kRow:
                for (std::size_t at = 0; at < type.bytes; at += type.each->bytes)
                    one(m, *type.each, static_cast<std::byte*>(value) + at);
                return;
            case ValueKind::kValue:
                fill(*type.described, value);
                return;
            case ValueKind::kBytes:
                return;
        }
    }
    void integer(const MemberEntry& m, const ValueType& type, void* value) {
        std::uint64_t number = random_();
        if (type.id == IdKind::kObjectType)
            number %= 12;
        else if (type.id != IdKind::kNone && m.form != MemberForm::kFixed)
            number %= 1u << 20;
        else if (type.id == IdKind::kNone && type.bytes == 8)
            number >>= 12;
        else if (type.bytes < 8)
            number >>= 64 - 8 * type.bytes;
        if (type.kind == ValueKind::kSigned)
            number -= std::uint64_t{1} << (8 * std::min<std::size_t>(type.bytes, 6) - 1);
        setInteger(type, value, number);
    }
    /// One behind which nothing is lost by a text of 17 digits: any double.
    double number(const MemberEntry& m) {
        const double least = std::max(m.bounds.least, -1e6), greatest = std::min(m.bounds.greatest, 1e6);
        double value = 0;
        do value = std::uniform_real_distribution(least, greatest)(random_);
        while (!m.bounds.hold(value));
        return value;
    }

    std::mt19937_64 random_;
};

}  // namespace tessera
