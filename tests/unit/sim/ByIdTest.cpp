#include "server/sim/frame/ById.h"

#include <gtest/gtest.h>

#include <map>

#include "tests/property/Seeds.h"

namespace tessera {
namespace {

TEST(ById, HoldsWhatAMapHoldsInWhateverOrderItComes) {
    forSeeds(100, [](Random& random) {
        ById<int> values;
        std::map<ObjectId, int> truth;
        const std::uint64_t ids = 1 + random() % 300;
        for (int step = 0; step < 400; ++step) {
            const ObjectId id(random() % 8 == 0 ? random() : random() % ids);
            if (random() % 16 == 0) {
                const std::uint64_t modulus = 1 + random() % 5;
                const auto gone = [&](ObjectId one) { return one.value % modulus == 0; };
                values.eraseIf(gone);
                std::erase_if(truth, [&](const auto& row) { return gone(row.first); });
            } else if (random() % 32 == 0) {
                ASSERT_EQ(values.take(), (std::vector<ById<int>::Row>(truth.begin(), truth.end())));
                truth.clear();
            } else if (random() % 64 == 0) {
                values.clear();
                truth.clear();
            } else {
                const auto [value, isNew] = values.add(id);
                ASSERT_EQ(isNew, !truth.contains(id));
                ASSERT_EQ(value, truth[id]);
                value = truth[id] = step;
            }
            const int* found = values.find(id);
            ASSERT_EQ(found != nullptr, truth.contains(id));
            if (found) {
                ASSERT_EQ(*found, truth.at(id));
            }
            ASSERT_EQ(values.size(), truth.size());
            if (random() % 8 == 0) {
                ASSERT_EQ(values.ascending(), (std::vector<ById<int>::Row>(truth.begin(), truth.end())));
            }
        }
    });
}

}  // namespace
}  // namespace tessera
