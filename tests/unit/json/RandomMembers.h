/// Any described value, within the bounds of its description.
#pragma once

#include <random>

#include "common/request/Requests.h"

namespace tessera {

class RandomMembers {
public:
    explicit RandomMembers(std::uint64_t seed) : random_(seed) {}

    template <HasMembers T>
    void fill(T& value) {
        forEachMember<T>([&]<typename M>(const M& m) {
            if constexpr (M::kForm != MemberForm::kReserved && M::kForm != MemberForm::kRest)
                if (m.when == nullptr || m.when(value)) one(m, M::of(value));
        });
    }
    std::uint64_t below(std::uint64_t bound) { return random_() % bound; }

private:
    template <typename M, typename T>
    void one(const M& m, T& value) {
        constexpr ValueKind kind = valueKindOfHeld<T>();
        if constexpr (kIsOptional<T>) {
            value.reset();
            if (below(2) == 0) one(m, value.emplace());
        } else if constexpr (kIsMany<T>) {
            value.clear();
            for (std::uint64_t i = below(4); i > 0; --i) one(m, value.emplace_back());
        } else if constexpr (kind == ValueKind::kBool) {
            value = below(2) == 0;
        } else if constexpr (kind == ValueKind::kWord) {
            value = static_cast<T>(below(WordsOf<T>::kWords.size()));
        } else if constexpr (std::is_same_v<T, ObjectType>) {
            value = ObjectType(static_cast<std::uint16_t>(below(12)));
        } else if constexpr (kIsId<T>) {
            value = T(static_cast<decltype(value.value)>(M::kForm == MemberForm::kFixed ? random_() : below(1u << 20)));
        } else if constexpr (kind == ValueKind::kUnsigned || kind == ValueKind::kSigned) {
            value = static_cast<T>(random_());
            if constexpr (sizeof(T) == 8) value >>= 12;
        } else if constexpr (kind == ValueKind::kNumber) {
            value = number(m);
        } else if constexpr (kind == ValueKind::kText) {
            static constexpr std::string_view kTexts[] = {"", "/hall/crane", "\"quoted\"\n", "größe", "$", "#"};
            value = kTexts[below(std::size(kTexts))];
        } else if constexpr (kind == ValueKind::kPlace || kind == ValueKind::kVector) {
            for (double& each : value) each = number(m);
        } else if constexpr (kind == ValueKind::kRotation) {
            value = Quatd(number(m), 1, number(m), number(m));
        } else if constexpr (kind == ValueKind::kRow) {
            for (auto& each : value) one(m, each);
        } else if constexpr (kind == ValueKind::kValue) {
            fill(value);
        }
    }
    /// One behind which nothing is lost by a text of 17 digits: any double.
    template <typename M>
    double number(const M& m) {
        const double least = std::max(m.bounds.least, -1e6), greatest = std::min(m.bounds.greatest, 1e6);
        double value = 0;
        do value = std::uniform_real_distribution(least, greatest)(random_);
        while (!m.bounds.hold(value));
        return value;
    }
    template <typename T>
    static constexpr ValueKind valueKindOfHeld() {
        return valueKindOf<typename HeldBy<T>::Type>();
    }

    std::mt19937_64 random_;
};

}  // namespace tessera
