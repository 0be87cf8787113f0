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

/// Two journals that began with the same scene.
struct TwoJournals {
    LeftJournal own, other;
};

const TwoJournals& twoJournalsOf(std::uint64_t seed) {
    constexpr std::uint64_t kSeeds = 500;
    static std::uint64_t of = ~std::uint64_t{0};
    static std::vector<TwoJournals> pairs;
    if (of != seed / kSeeds) {
        of = seed / kSeeds;
        pairs.clear();
        for (int i = 0; i < 16; ++i) {
            const std::uint64_t scene = 1000 * (of + 1) + static_cast<std::uint64_t>(i);
            Random one(scene), two(scene);
            const int servers = 1 + i / 4;
            const bool killed = i % 2 == 0, snapshot = i >= 8 && i % 4 >= 2;
            // Most have equal lengths.
            const std::uint64_t turn = i % 3 == 0 ? 17 : 0;
            pairs.push_back({test::leftJournal(one, servers, killed, snapshot),
                             test::leftJournal(two, i % 5 == 0 ? servers + 1 : servers, killed, snapshot, turn)});
        }
    }
    return pairs[seed % pairs.size()];
}

/// Puts files of another journal, or sectors of them, in the place of a journal's own.
struct Exchange {
    Exchange(const TwoJournals& journals, Random& random) : files(journals.own.files) {
        for (std::size_t i = oneIn(random, 2) ? 1 : 2 + below(random, 2); i > 0; --i) {
            const auto& [name, content] = *std::next(
                journals.other.files.begin(), static_cast<std::ptrdiff_t>(below(random, journals.other.files.size())));
            hit.insert(name);
            std::string& file = files[name];
            const std::size_t sector = oneIn(random, 2) ? 512 : 4096;
            const std::size_t at = below(random, content.size() / sector + 1) * sector;
            if (!oneIn(random, 3) || at >= file.size()) {
                done += fmt::format("{} exchanged; ", name);
                file = content;
                continue;
            }
            done += fmt::format("{} bytes at {} of {} exchanged; ", sector, at, name);
            file.replace(at, sector, content.substr(at, sector));
            sectors = true;
        }
    }
    /// Whether each of those is there as it was.
    [[nodiscard]] bool hasAll(const test::JournalBytes& whole) const {
        return std::ranges::all_of(whole, [&](const auto& entry) {
            const auto found = files.find(entry.first);
            return found != files.end() && found->second == entry.second;
        });
    }

    test::JournalBytes files;
    std::set<std::string> hit;  ///< names
    std::string done;           ///< in words
    bool sectors = false;
};

TEST(JournalDamage, FilesOfAnotherJournalAreRefusedByName) {
    const test::TestFolder folder;
    const Seeds seeds(150);
    std::uint64_t refused = 0, whole = 0;
    for (std::uint64_t seed = seeds.first; seed < seeds.end; ++seed) {
        const TwoJournals& journals = twoJournalsOf(seed);
        ASSERT_FALSE(testing::Test::HasFailure());
        Random random(seed);
        Exchange exchange(journals, random);
        while (exchange.files == journals.own.files) exchange = Exchange(journals, random);
        SCOPED_TRACE(fmt::format("TESSERA_SEED={}: {}", seed, exchange.done));
        test::ModelDisk::write(exchange.files, folder / "wall");
        const Start start(folder / "wall");
        if (start.refusal) {
            ++refused;
            EXPECT_TRUE(std::ranges::any_of(exchange.hit, [&](const std::string& name) {
                return start.refusal->message.find(name == "last" ? "wall/last" : name) != std::string::npos;
            })) << start.refusal->message;
            EXPECT_EQ(start.refusal->code, ErrorCode::kBadInput) << start.refusal->message;
            EXPECT_EQ(test::bytesIn(folder / "wall"), exchange.files) << "a refused start has changed something";
        } else if (exchange.hasAll(journals.other.files)) {
            EXPECT_TRUE(*start.state == journals.other.granted) << "all files are the other journal's";
        } else {
            ++whole;
            EXPECT_TRUE(*start.state == journals.own.granted) << "granted edits are gone";
            EXPECT_TRUE(exchange.sectors || exchange.hasAll(journals.own.files)) << "a file was taken for its own";
        }
        if (testing::Test::HasFailure()) return;
    }
    RecordProperty("refused", static_cast<int>(refused));
    RecordProperty("whole", static_cast<int>(whole));
    EXPECT_GT(refused, 0u);
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
