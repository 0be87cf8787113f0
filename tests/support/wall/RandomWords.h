/// Random words of applications, allowed and not: requests of all kinds with members near and beyond their bounds,
/// and proposals of lists that nobody means.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "common/request/Description.h"
#include "common/request/Requests.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"
#include "tests/support/wall/Timeline.h"

namespace tessera::simulation {

/// Ids and paths are mostly those of `scene`, which outlives it. One in `wildness` values is beyond its bounds. Nobody
/// speaks of `untouched`.
class RandomWords {
public:
    RandomWords(Random& random, const Aspect& scene, std::vector<std::string> files, std::set<ObjectId> untouched = {},
                std::uint64_t wildness = 12)
        : random_(random),
          scene_(scene),
          files_(std::move(files)),
          untouched_(std::move(untouched)),
          wildness_(wildness) {
        for (const ObjectId id : scene.ids()) {
            if (untouched_.contains(id)) continue;
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

    void fill(const Description& of, void* value);
    template <HasMembers T>
    void fill(T& value) {
        fill(descriptionOf<T>(), &value);
    }

private:
    static constexpr double kFar = 1e3;
    [[nodiscard]] bool wild() { return random_.below(wildness_) == 0; }
    [[nodiscard]] FieldValue other(const FieldInfo& field, FieldValue value);

    void one(const MemberEntry& m, const ValueType& type, void* value);

    Random& random_;
    const Aspect& scene_;
    std::vector<std::string> files_;
    std::set<ObjectId> untouched_;
    std::uint64_t wildness_;
    std::vector<ObjectId> all_, nodes_;
};

}  // namespace tessera::simulation
