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

struct RandomWordsOptions {
    std::vector<std::string> files = {};  ///< whose paths some texts are
    std::set<ObjectId> untouched = {};    ///< nobody speaks of them
    std::uint64_t wildness = 12;          ///< one in so many values is beyond its bounds
    bool still = false;                   ///< lists make nothing that moves by itself
};

/// Ids and paths are mostly those of `scene`, which outlives it.
class RandomWords {
public:
    RandomWords(Random& random, const Aspect& scene, RandomWordsOptions options = {});

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
    [[nodiscard]] bool wild() { return random_.below(options_.wildness) == 0; }
    /// Whether a list may make one.
    [[nodiscard]] bool mayBeIn(const TypeInfo& type) const;
    [[nodiscard]] FieldValue other(const FieldInfo& field, FieldValue value);

    void foreign(ChangeListBuilder& list, ObjectId object);
    void one(const MemberEntry& m, const ValueType& type, void* value);

    Random& random_;
    const Aspect& scene_;
    RandomWordsOptions options_;
    std::vector<ObjectId> all_, nodes_;
};

}  // namespace tessera::simulation
