/// Damage to a journal: a start refuses it by name, or has every edit that was granted.
#include <cstdlib>

#include "tests/unit/journal/DamagedFolder.h"

namespace tessera {
namespace {

using test::Damage;
using test::LeftJournal;
using test::Start;

/// TESSERA_SEED is the first; TESSERA_RUNS says how many.
struct Seeds {
    explicit Seeds(std::uint64_t count) {
        const char *const seed = std::getenv("TESSERA_SEED"), *const runs = std::getenv("TESSERA_RUNS");
        first = seed ? std::strtoull(seed, nullptr, 10) : 1;
        end = first + (runs ? std::strtoull(runs, nullptr, 10) : seed ? 1 : count);
    }
    std::uint64_t first = 1, end = 0;
};

/// The journals of a few hundred seeds: one log; several; with snapshots; killed, or ended in order.
const std::vector<LeftJournal>& journalsOf(std::uint64_t seed) {
    constexpr std::uint64_t kSeeds = 500;
    static std::uint64_t of = ~std::uint64_t{0};
    static std::vector<LeftJournal> journals;
    if (of == seed / kSeeds) return journals;
    of = seed / kSeeds;
    journals.clear();
    Random random(of + 1);
    for (int i = 0; i < 8; ++i) journals.push_back(test::leftJournal(random, 1 + i / 2, i % 2 == 0, i >= 4));
    return journals;
}

TEST(JournalDamage, IsRefusedByNameOrNothingGrantedIsLost) {
    const test::TestFolder folder;
    const Seeds seeds(150);
    std::uint64_t refused = 0, whole = 0;
    for (std::uint64_t seed = seeds.first; seed < seeds.end; ++seed) {
        const LeftJournal& journal = journalsOf(seed)[seed % journalsOf(seed).size()];
        ASSERT_FALSE(testing::Test::HasFailure());
        Random random(seed);
        Damage damage(journal.files);
        while (damage.files == journal.files || damage.files.empty()) {
            damage = Damage(journal.files);
            for (std::size_t i = oneIn(random, 3) ? 2 + below(random, 3) : 1; i > 0; --i) damage.anywhere(random);
        }
        SCOPED_TRACE(fmt::format("TESSERA_SEED={}: {}", seed, damage.done));
        test::ModelDisk::write(damage.files, folder / "wall");
        const Start start(folder / "wall");
        if (start.refusal) {
            ++refused;
            EXPECT_TRUE(std::ranges::any_of(damage.hit, [&](const std::string& name) {
                return start.refusal->message.find(name == "last" ? "wall/last" : name) != std::string::npos;
            })) << start.refusal->message;
            EXPECT_EQ(start.refusal->code, ErrorCode::kBadInput) << start.refusal->message;
            EXPECT_EQ(test::bytesIn(folder / "wall"), damage.files) << "a refused start has changed something";
        } else {
            ++whole;
            EXPECT_TRUE(*start.state == journal.granted) << "granted edits are gone";
            const Start again(folder / "wall");
            ASSERT_TRUE(again.state) << again.refusal->message;
            EXPECT_TRUE(*again.state == *start.state) << "the second start has another state";
        }
        if (testing::Test::HasFailure()) return;
    }
    RecordProperty("refused", static_cast<int>(refused));
    RecordProperty("whole", static_cast<int>(whole));
    if (seeds.end - seeds.first >= 100) {
        EXPECT_GT(refused, 0u);
        EXPECT_GT(whole, 0u);
    }
}

}  // namespace
}  // namespace tessera
