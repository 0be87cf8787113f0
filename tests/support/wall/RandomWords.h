/// Random words of applications, allowed and not: requests of all kinds with members near and beyond their bounds,
/// and proposals of lists that nobody means.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "common/request/Requests.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"
#include "tests/support/wall/Timeline.h"

namespace tessera::simulation {

/// Ids and paths are mostly those of `scene`, which outlives it. One in `wildness` values is beyond its bounds.
class RandomWords {
public:
    RandomWords(Random& random, const Aspect& scene, std::vector<std::string> files, std::uint64_t wildness = 12)
        : random_(random), scene_(scene), files_(std::move(files)), wildness_(wildness) {
        for (const ObjectId id : scene.ids()) {
            all_.push_back(id);
            if (scene.find(id).as<Node>()) nodes_.push_back(id);
        }
    }

    [[nodiscard]] ApplicationRequest request();
    /// Changes of what there is: values, places, objects that come and go. Empty ones, too.
    [[nodiscard]] ChangeList list();
    [[nodiscard]] double number(double least = -kFar, double greatest = kFar);
    [[nodiscard]] std::string text();
    [[nodiscard]] ObjectId anyNode();

    template <HasMembers T>
    void fill(T& value) {
        forEachMember<T>([&]<typename M>(const M& m) {
            if constexpr (M::kForm == MemberForm::kSpread)
                fill(M::of(value));
            else if constexpr (M::kForm != MemberForm::kReserved && M::kForm != MemberForm::kRest)
                if (m.when == nullptr || m.when(value)) one(m, M::of(value));
        });
    }

private:
    static constexpr double kFar = 1e3;
    [[nodiscard]] bool wild() { return random_.below(wildness_) == 0; }
    [[nodiscard]] FieldValue other(const FieldInfo& field, FieldValue value);

    template <typename M, typename T>
    void one(const M& m, T& value) {
        constexpr ValueKind kind = valueKindOf<typename HeldBy<T>::Type>();
        if constexpr (kIsOptional<T>) {
            value.reset();
            if (random_.below(2) == 0) one(m, value.emplace());
        } else if constexpr (kIsMany<T>) {
            value.clear();
            for (std::uint64_t i = random_.below(4); i > 0; --i) one(m, value.emplace_back());
        } else if constexpr (kind == ValueKind::kBool) {
            value = random_.below(2) == 0;
        } else if constexpr (kind == ValueKind::kWord) {
            value = static_cast<T>(random_.below(WordsOf<T>::kWords.size() + (wild() ? 2 : 0)));
        } else if constexpr (std::is_same_v<T, ObjectId>) {
            value = wild() ? ObjectId{random_.below(1 << 16)} : anyNode();
        } else if constexpr (std::is_same_v<T, ObjectType>) {
            value = allTypes()[random_.below(allTypes().size())].type;
        } else if constexpr (kIsId<T>) {
            value = T(static_cast<decltype(value.value)>(random_.below(64)));
        } else if constexpr (kind == ValueKind::kUnsigned || kind == ValueKind::kSigned) {
            value = static_cast<T>(wild() ? random_.next() : random_.below(20));
        } else if constexpr (kind == ValueKind::kNumber) {
            value = number(m.bounds.least, m.bounds.greatest);
        } else if constexpr (kind == ValueKind::kText) {
            value = text();
        } else if constexpr (kind == ValueKind::kPlace || kind == ValueKind::kVector) {
            for (double& each : value) each = number(m.bounds.least, m.bounds.greatest);
        } else if constexpr (kind == ValueKind::kRotation) {
            const double w = number(-1, 1), x = number(-1, 1), y = number(-1, 1);
            value = Quatd(w, x, y, number(-1, 1));
        } else if constexpr (kind == ValueKind::kRow) {
            for (auto& each : value) one(m, each);
        } else if constexpr (kind == ValueKind::kBytes) {
            Bytes bytes(random_.below(200));
            for (std::byte& each : bytes) each = static_cast<std::byte>(random_.next());
            value = ByteSlice(std::move(bytes));
        } else if constexpr (kind == ValueKind::kValue) {
            fill(value);
        }
    }

    Random& random_;
    const Aspect& scene_;
    std::vector<std::string> files_;
    std::uint64_t wildness_;
    std::vector<ObjectId> all_, nodes_;
};

}  // namespace tessera::simulation
