/// Arrays in memory that hosts of one machine have in common: found, proved, let go of, and never believed.
#include "client/share/SharedArrays.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <ctime>
#include <filesystem>
#include <functional>
#include <optional>
#include <random>
#include <set>
#include <tuple>

#include "tests/unit/Eventually.h"

namespace tessera {
namespace {

constexpr std::size_t kBytes = 300'000;

Bytes noise(unsigned seed, std::size_t bytes = kBytes) {
    std::mt19937 random(seed);
    Bytes made(bytes);
    for (std::byte& b : made) b = static_cast<std::byte>(random());
    return made;
}
BlobInfo infoOf(const Blob& blob) {
    return {blob.id(), blob.sizeBytes()};
}

/// Another process, that does something, says so, and then does something else until its end, or waits for that.
class Neighbour {
public:
    explicit Neighbour(
        const std::function<void()>& work, const std::function<void()>& forEver = [] { pause(); }) {
        int ready[2];
        if (pipe(ready) != 0) std::abort();
        const pid_t parent = getpid();
        pid_ = fork();
        if (pid_ == 0) {
            prctl(PR_SET_PDEATHSIG, SIGKILL);
            if (getppid() != parent) _exit(0);
            work();
            (void)!write(ready[1], "x", 1);
            for (;;) forEver();
        }
        char said = 0;
        close(ready[1]);
        ready_ = read(ready[0], &said, 1) == 1;
        close(ready[0]);
    }
    ~Neighbour() { end(); }
    void end() {
        if (pid_ > 0) {
            kill(pid_, SIGKILL);
            waitpid(pid_, nullptr, 0);
        }
        pid_ = -1;
    }
    [[nodiscard]] pid_t pid() const { return pid_; }
    [[nodiscard]] bool ready() const { return ready_; }

private:
    pid_t pid_ = -1;
    bool ready_ = false;
};

SharedArrays looksAt(Log& log, pid_t neighbour) {
    return SharedArrays(log, [neighbour] { return std::vector<pid_t>{neighbour}; });
}

/// The file in memory that holds these bytes.
ino_t placeOf(const Blob& blob) {
    const auto at = reinterpret_cast<unsigned long>(blob.bytes().data());  // maps them, if nobody has
    std::FILE* maps = std::fopen("/proc/self/maps", "r");
    char line[512];
    ino_t found = 0;
    while (maps && std::fgets(line, sizeof line, maps)) {
        unsigned long from = 0, to = 0, node = 0;
        if (std::sscanf(line, "%lx-%lx %*s %*s %*s %lu", &from, &to, &node) != 3) continue;
        if (from <= at && at < to) found = node;
    }
    if (maps) std::fclose(maps);
    return found;
}

TEST(SharedArrays, AreFoundWithANeighbourAndOutliveIt) {
    Log log("test");
    const Blob own(noise(1));
    Neighbour neighbour([&] {
        static SharedArrays shared(log, [] { return std::vector<pid_t>{}; });
        static Blob kept = shared.share(Blob(noise(1)));
    });
    ASSERT_TRUE(neighbour.ready());
    SharedArrays others = looksAt(log, neighbour.pid());
    EXPECT_TRUE(others.find(infoOf(Blob(noise(2)))).empty()) << "what it does not have";
    const Blob there = others.find(infoOf(own));
    ASSERT_TRUE(there.resident());
    EXPECT_EQ(there.id(), own.id());
    const Blob again = others.share(Blob(noise(1)));
    EXPECT_EQ(placeOf(again), placeOf(there)) << "once in memory";
    EXPECT_NE(placeOf(there), 0u);
    EXPECT_EQ(others.counts().found, 2u);
    EXPECT_EQ(others.counts().own, 0u);
    neighbour.end();
    EXPECT_EQ(blobIdOf(there.bytes()), own.id()) << "the memory lives as long as anybody maps it";
}

/// A large one as it comes from a server: its pieces are put where they stay.
Blob fetched(SharedArrays& shared, ByteSpan bytes, const BlobInfo& info, std::size_t piece) {
    BlobMaker made(info.sizeBytes, shared.place(info));
    for (std::size_t at = 0; at < bytes.size(); at += piece)
        made.write(at, bytes.subspan(at, std::min(piece, bytes.size() - at)));
    return made.finish();
}

TEST(SharedArrays, WhatComesInPiecesIsInItsPlaceAlready) {
    Log log("test");
    const Bytes bytes = noise(3, Blob::kPagedBytes + 70'001);
    const BlobInfo info = infoOf(Blob(bytes));
    SharedArrays shared(log, [] { return std::vector<pid_t>{}; });
    const Blob came = fetched(shared, bytes, info, 256 << 10);
    EXPECT_EQ(came.id(), info.id);
    const std::uint64_t before = placeOf(came);
    EXPECT_NE(before, 0u) << "it lies in memory that others can map";
    const Blob there = shared.share(came);
    EXPECT_EQ(placeOf(there), before) << "and is copied nowhere";
    EXPECT_EQ(blobIdOf(there.bytes()), info.id);
    EXPECT_EQ(shared.counts().ownBytes, info.sizeBytes);
    EXPECT_EQ(shared.place({info.id, Blob::kPagedBytes - 1}), nullptr) << "a small one is copied";
    // One that came damaged is not taken for what it was to be.
    Bytes wrong = bytes;
    wrong[5] ^= std::byte{1};
    EXPECT_NE(fetched(shared, wrong, info, 1 << 20).id(), info.id);
    EXPECT_EQ(blobIdOf(shared.share(Blob(bytes)).bytes()), info.id);
}

void stepOn(SharedArrays& arrays, std::chrono::milliseconds howLong = std::chrono::seconds(30)) {
    (void)test::eventually(
        [&] {
            arrays.step(clockNow());
            return arrays.nextStep() == TimePoint::max();
        },
        howLong);
}

TEST(SharedArrays, WhoHasFetchedTheSameLaterGivesWayInPlace) {
    Log log("test");
    const Bytes bytes = noise(4, 3 * Blob::kPagedBytes + 70'001);
    const BlobInfo info = infoOf(Blob(bytes));
    Neighbour other([&] {
        static SharedArrays shared(log, [] { return std::vector<pid_t>{}; });
        static Blob kept = shared.share(fetched(shared, bytes, info, 256 << 10));
    });
    ASSERT_TRUE(other.ready());
    // A file's time is that of the last tick: ours gets a later one.
    const auto tick = [] {
        timespec last{};
        ::clock_gettime(CLOCK_REALTIME_COARSE, &last);
        return std::tuple(last.tv_sec, last.tv_nsec);
    };
    ASSERT_TRUE(test::eventually([&, before = tick()] { return tick() > before; }));
    SharedArrays arrays = looksAt(log, other.pid());
    const Blob came = arrays.share(fetched(arrays, bytes, info, 256 << 10));
    const std::byte* const where = came.bytes().data();
    const ino_t before = placeOf(came);
    EXPECT_EQ(arrays.counts().own, 1u);
    stepOn(arrays);
    EXPECT_EQ(arrays.counts().own, 0u);
    EXPECT_EQ(arrays.counts().foundBytes, info.sizeBytes);
    EXPECT_EQ(came.bytes().data(), where);
    EXPECT_EQ(blobIdOf(came.bytes()), info.id);
    EXPECT_NE(placeOf(came), before);
    EXPECT_EQ(placeOf(came), placeOf(arrays.find(info)));
    other.end();
    EXPECT_EQ(blobIdOf(came.bytes()), info.id) << "it lives as long as anybody maps it";
    const Blob edited = *came.withRange(5, ByteSpan(bytes).first(9'000));
    Bytes expected = bytes;
    std::ranges::copy(ByteSpan(bytes).first(9'000), expected.begin() + 5);
    EXPECT_TRUE(std::ranges::equal(edited.bytes(), expected));
}

/// Another process that has had these bytes since a year, by hand: listed so often, the last of them right.
Neighbour hadSince(int year, const Bytes& bytes, const BlobInfo& info, std::size_t falseEntries = 0) {
    return Neighbour([&, year, falseEntries] {
        const int directory = memfd_create("tessera-arrays-1", MFD_ALLOW_SEALING),
                  file = memfd_create("tessera-array", MFD_ALLOW_SEALING);
        if (ftruncate(directory, 32 * SharedArrays::kMostArrays) != 0 ||
            write(file, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()))
            _exit(1);
        const timespec at{(year - 1970) * 365L * 86'400, 0}, both[2] = {at, at};
        if (futimens(file, both) != 0) _exit(1);
        fcntl(file, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE);
        fcntl(directory, F_ADD_SEALS, F_SEAL_SHRINK);
        for (std::size_t i = 0; i <= falseEntries; ++i) {
            const std::uint64_t named = i < falseEntries ? 900'000 : static_cast<std::uint64_t>(file) + 1;
            const std::uint64_t entry[4] = {info.id.low, info.id.high, info.sizeBytes, named};
            if (pwrite(directory, entry, sizeof entry, static_cast<off_t>(i * sizeof entry)) != sizeof entry) _exit(1);
        }
    });
}

TEST(SharedArrays, NobodyGivesWayToOtherBytesOrALaterFile) {
    Log log("test");
    const Bytes bytes = noise(4, Blob::kPagedBytes + 70'001);
    const BlobInfo info = infoOf(Blob(bytes));
    for (const auto& [differs, year, gives] : {std::tuple(bytes.size() - 1, 2001, false),
                                               {bytes.size() - 600'000, 2001, false},
                                               {bytes.size(), 2101, false},
                                               {bytes.size(), 2001, true}}) {
        Bytes theirs = bytes;
        if (differs < theirs.size()) theirs[differs] ^= std::byte{1};
        Neighbour other = hadSince(year, theirs, info);
        ASSERT_TRUE(other.ready());
        SharedArrays ours = looksAt(log, other.pid());
        const Blob came = ours.share(fetched(ours, bytes, info, 1 << 20));
        const ino_t place = placeOf(came);
        stepOn(ours);
        EXPECT_EQ(blobIdOf(came.bytes()), info.id) << differs << " " << year;
        EXPECT_EQ(placeOf(came) == place, !gives)
            << differs << " " << year << ": pages that were laid over are ours again";
        EXPECT_EQ(ours.counts().own, gives ? 0u : 1u) << differs << " " << year;
    }
}

TEST(SharedArrays, OneThatLiesKeepsNobodyFromGivingWayToAnother) {
    Log log("test");
    const Bytes bytes = noise(5, Blob::kPagedBytes + 70'001);
    const BlobInfo info = infoOf(Blob(bytes));
    Bytes wrong = bytes;
    wrong.back() ^= std::byte{1};
    Neighbour liar = hadSince(1980, wrong, info), another = hadSince(1990, wrong, info),
              honest = hadSince(2001, bytes, info);
    ASSERT_TRUE(liar.ready() && another.ready() && honest.ready());
    SharedArrays ours(log, [&] { return std::vector<pid_t>{liar.pid(), another.pid(), honest.pid()}; });
    const Blob came = ours.share(fetched(ours, bytes, info, 1 << 20));
    stepOn(ours);
    EXPECT_EQ(ours.counts().found, 1u);
    EXPECT_EQ(blobIdOf(came.bytes()), info.id);
    // Who has lied is not asked again: the honest one is found in the first look, whatever its place among them.
    EXPECT_TRUE(ours.find(info).resident());
    // Each look in vain costs one hash at most.
    SharedArrays others(log, [&] { return std::vector<pid_t>{liar.pid(), another.pid(), honest.pid()}; });
    int looks = 0;
    while (others.find(info).empty() && looks < 10) ++looks;
    EXPECT_LE(looks, 2);
}

TEST(SharedArrays, OfAThousandFalseEntriesAFewAreTried) {
    Log log("test");
    const Bytes bytes = noise(6, Blob::kPagedBytes);
    const BlobInfo info = infoOf(Blob(bytes));
    for (const std::size_t falseOnes : {OthersArrayDirectory::kMostTries - 1, SharedArrays::kMostArrays - 1}) {
        Neighbour other = hadSince(2001, bytes, info, falseOnes);
        ASSERT_TRUE(other.ready());
        SharedArrays ours = looksAt(log, other.pid());
        EXPECT_EQ(ours.find(info).resident(), falseOnes < OthersArrayDirectory::kMostTries) << falseOnes;
    }
}

TEST(SharedArrays, ThoseThatFetchTheSameAtOnceEndWithOne) {
    Log log("test");
    constexpr int kThem = 4;
    const Bytes bytes = noise(6, 2 * Blob::kPagedBytes);
    const BlobInfo info = infoOf(Blob(bytes));
    auto* const shared = static_cast<std::uint64_t*>(
        mmap(nullptr, 2 * kThem * sizeof(std::uint64_t), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
    {
        const auto one = [&](int which) {
            return [&, which] {
                SharedArrays arrays(log);
                const Blob came = arrays.share(fetched(arrays, bytes, info, 256 << 10));
                stepOn(arrays);
                __atomic_store_n(&shared[which], placeOf(came), __ATOMIC_SEQ_CST);
                for (;;) pause();
            };
        };
        const Neighbour a([] {}, one(0)), b([] {}, one(1)), c([] {}, one(2)), d([] {}, one(3));
        const auto done = [&] {
            return std::all_of(shared, shared + kThem,
                               [](std::uint64_t& place) { return __atomic_load_n(&place, __ATOMIC_SEQ_CST) != 0; });
        };
        ASSERT_TRUE(test::eventually(done));
    }
    EXPECT_EQ(std::set<std::uint64_t>(shared, shared + kThem).size(), 1u);
    munmap(shared, 2 * kThem * sizeof(std::uint64_t));
}

TEST(SharedArrays, AreHandedOnByThoseWhoFoundThem) {
    Log log("test");
    Neighbour first([&] {
        static SharedArrays shared(log, [] { return std::vector<pid_t>{}; });
        static Blob kept = shared.share(Blob(noise(1)));
    });
    Neighbour second([&, pid = first.pid()] {
        static SharedArrays shared(log, [pid] { return std::vector<pid_t>{pid}; });
        static Blob kept = shared.find(infoOf(Blob(noise(1))));
    });
    ASSERT_TRUE(first.ready() && second.ready());
    first.end();
    SharedArrays arrays = looksAt(log, second.pid());
    EXPECT_TRUE(arrays.find(infoOf(Blob(noise(1)))).resident());
}

TEST(SharedArrays, AreNobodysButTheirUsers) {
    Log log("test");
    SharedArrays shared(log, [] { return std::vector<pid_t>{}; });
    const Blob own = shared.share(Blob(noise(1)));
    int files = 0;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
        std::error_code error;
        const std::string target = std::filesystem::read_symlink(entry.path(), error);
        struct stat status {};
        if (!target.starts_with("/memfd:tessera-array") || ::stat(entry.path().c_str(), &status) != 0) continue;
        EXPECT_EQ(status.st_mode & 0777, 0600u) << target;
        ++files;
    }
    EXPECT_GE(files, 2) << "the directory, and an array";
}

TEST(SharedArrays, SmallAbsentAndEmptyBlobsStayWhereTheyAre) {
    Log log("test");
    SharedArrays arrays(log, [] { return std::vector<pid_t>{}; });
    const Blob small(noise(1, SharedArrays::kLeastBytes - 1)), absent = Blob::absent(small.id(), kBytes);
    EXPECT_EQ(arrays.share(small).bytes().data(), small.bytes().data());
    EXPECT_FALSE(arrays.share(absent).resident());
    EXPECT_TRUE(arrays.share(Blob()).empty());
    EXPECT_EQ(arrays.counts().own, 0u);
}

TEST(SharedArrays, LetGoOfWhatNobodyHolds) {
    Log log("test");
    SharedArrays arrays(log, [] { return std::vector<pid_t>{}; });
    const auto open = [] {
        return std::distance(std::filesystem::directory_iterator("/proc/self/fd"),
                             std::filesystem::directory_iterator());
    };
    const auto before = open();
    // More than there is room for at a time: places are used again.
    for (unsigned i = 0; i < SharedArrays::kMostArrays + 100; ++i) {
        const Blob blob = arrays.share(Blob(Bytes(SharedArrays::kLeastBytes, static_cast<std::byte>(i))));
        ASSERT_EQ(arrays.counts().own, i + 1);
    }
    EXPECT_EQ(open(), before);
}

TEST(SharedArrays, WhereTheyHaveNoRoomBlobsStayWhereTheyAre) {
    Log log("test");
    Neighbour full([&] {
        rlimit few{.rlim_cur = 64, .rlim_max = 64};
        setrlimit(RLIMIT_NOFILE, &few);
        SharedArrays arrays(log, [] { return std::vector<pid_t>{}; });
        std::vector<Blob> held;
        for (unsigned i = 0; i < 100; ++i) {
            held.push_back(arrays.share(Blob(noise(i, SharedArrays::kLeastBytes))));
            if (blobIdOf(held.back().bytes()) != blobIdOf(noise(i, SharedArrays::kLeastBytes))) _exit(1);
        }
        if (arrays.counts().own != 32) _exit(2);  // half of the files that may be open
        const int another = open("/dev/null", O_RDONLY);
        if (another < 0) _exit(3);
    });
    EXPECT_TRUE(full.ready());
}

TEST(SharedArrays, TwoThatHaveTheSameAtOnceEndWithOne) {
    Log log("test");
    constexpr unsigned kBlobs = 100;
    // Memory that both write the places of their blobs into.
    auto* const places = static_cast<std::uint64_t*>(
        mmap(nullptr, 3 * kBlobs * sizeof(std::uint64_t), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
    const auto race = [&](unsigned which) {
        SharedArrays arrays(log);
        std::vector<Blob> held;
        for (unsigned i = 0; i < kBlobs; ++i) {
            // In step, so that each blob is a race.
            __atomic_add_fetch(&places[2 * kBlobs + i], 1, __ATOMIC_SEQ_CST);
            while (__atomic_load_n(&places[2 * kBlobs + i], __ATOMIC_SEQ_CST) < 2) sched_yield();
            held.push_back(arrays.share(Blob(noise(i, SharedArrays::kLeastBytes))));
            __atomic_store_n(&places[which * kBlobs + i], placeOf(held.back()), __ATOMIC_SEQ_CST);
        }
        for (;;) pause();
    };
    {
        const Neighbour one([] {}, [&] { race(0); }), other([] {}, [&] { race(1); });
        const auto done = [&] {
            return __atomic_load_n(&places[kBlobs - 1], __ATOMIC_SEQ_CST) != 0 &&
                   __atomic_load_n(&places[2 * kBlobs - 1], __ATOMIC_SEQ_CST) != 0;
        };
        EXPECT_TRUE(test::eventually(done));
    }
    int twice = 0;
    for (unsigned i = 0; i < kBlobs; ++i) twice += places[i] != places[kBlobs + i] ? 1 : 0;
    // One of the two may have been kept from running for longer than anybody waits: seldom.
    EXPECT_LE(twice, 4);
    munmap(places, 3 * kBlobs * sizeof(std::uint64_t));
}

/// Lays a directory into a process by hand, as a hostile neighbour would.
void pretend(const BlobInfo& info, std::uint64_t file, std::size_t directoryBytes, int seals,
             const char* name = "tessera-arrays-1") {
    const int directory = memfd_create(name, MFD_ALLOW_SEALING);
    if (ftruncate(directory, static_cast<off_t>(directoryBytes)) != 0) _exit(1);
    const std::uint64_t entry[4] = {info.id.low, info.id.high, info.sizeBytes, file + 1};
    if (pwrite(directory, entry, sizeof entry, 0) != sizeof entry) _exit(1);
    if (seals) fcntl(directory, F_ADD_SEALS, seals);
}

TEST(SharedArrays, BelieveNothingThatANeighbourSays) {
    Log log("test");
    constexpr std::size_t kDirectory = 32 * SharedArrays::kMostArrays;
    constexpr int kShrink = F_SEAL_SHRINK;
    const Blob wanted(noise(7));
    const BlobInfo info = infoOf(wanted);
    const auto memory = [](const Bytes& bytes, int seals, const char* name = "tessera-array") {
        const int file = memfd_create(name, MFD_ALLOW_SEALING);
        if (write(file, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size())) _exit(1);
        if (seals) fcntl(file, F_ADD_SEALS, seals);
        return static_cast<std::uint64_t>(file);
    };
    constexpr int kAll = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE;
    const std::vector<std::pair<std::string, std::function<void()>>> lies = {
        {"bytes that are others", [&] { pretend(info, memory(noise(8), kAll), kDirectory, kShrink); }},
        {"one byte less", [&] { pretend(info, memory(noise(7, kBytes - 1), kAll), kDirectory, kShrink); }},
        {"bytes that may still change",
         [&] { pretend(info, memory(noise(7), F_SEAL_SHRINK | F_SEAL_GROW), kDirectory, kShrink); }},
        {"bytes that may go away", [&] { pretend(info, memory(noise(7), 0), kDirectory, kShrink); }},
        {"memory of another name", [&] { pretend(info, memory(noise(7), kAll, "other"), kDirectory, kShrink); }},
        {"a pipe",
         [&] {
             int ends[2];
             if (pipe(ends) != 0) _exit(1);
             pretend(info, static_cast<std::uint64_t>(ends[0]), kDirectory, kShrink);
         }},
        {"a folder", [&] { pretend(info, static_cast<std::uint64_t>(open("/", O_RDONLY)), kDirectory, kShrink); }},
        {"no file at all", [&] { pretend(info, 987, kDirectory, kShrink); }},
        {"a number beyond any file's", [&] { pretend(info, ~std::uint64_t{1}, kDirectory, kShrink); }},
        {"a directory that may become shorter", [&] { pretend(info, memory(noise(7), kAll), kDirectory, 0); }},
        {"a directory that is too short", [&] { pretend(info, memory(noise(7), kAll), 4096, kShrink); }},
        {"a directory of another layout",
         [&] { pretend(info, memory(noise(7), kAll), kDirectory, kShrink, "tessera-arrays-0"); }},
    };
    for (const auto& [what, lie] : lies) {
        Neighbour neighbour(lie);
        ASSERT_TRUE(neighbour.ready()) << what;
        SharedArrays arrays = looksAt(log, neighbour.pid());
        EXPECT_TRUE(arrays.find(info).empty()) << what;
    }
    // The same by hand without a lie, so that what is refused above is refused for its lie.
    Neighbour honest([&] { pretend(info, memory(noise(7), kAll), kDirectory, kShrink); });
    SharedArrays arrays = looksAt(log, honest.pid());
    EXPECT_TRUE(arrays.find(info).resident());
}

TEST(SharedArrays, ANeighbourThatWritesNonsenseAllTheTimeHarmsNobody) {
    Log log("test");
    const Blob wanted(noise(7));
    std::uint64_t* words = nullptr;
    constexpr std::size_t kDirectory = 32 * SharedArrays::kMostArrays;
    std::mt19937 random(3);
    Neighbour wild(
        [&] {
            const int directory = memfd_create("tessera-arrays-1", MFD_ALLOW_SEALING);
            if (ftruncate(directory, kDirectory) != 0) _exit(1);
            fcntl(directory, F_ADD_SEALS, F_SEAL_SHRINK);
            words = static_cast<std::uint64_t*>(
                mmap(nullptr, kDirectory, PROT_READ | PROT_WRITE, MAP_SHARED, directory, 0));
        },
        [&] {
            const std::size_t at = random() % (kDirectory / 32) * 4;
            words[at] = wanted.id().low;
            words[at + 1] = wanted.id().high;
            words[at + 2] = random() % 2 ? wanted.sizeBytes() : random();
            words[at + 3] = random() % 16;
        });
    SharedArrays arrays = looksAt(log, wild.pid());
    for (int i = 0; i < 60; ++i) ASSERT_TRUE(arrays.find(infoOf(wanted)).empty());
}

TEST(SharedArrays, ProcessesOfThisProgramAreThoseThatRunIt) {
    Neighbour same([] {});
    const std::vector<pid_t> found = processesOfThisProgram();
    EXPECT_NE(std::find(found.begin(), found.end(), same.pid()), found.end());
    EXPECT_EQ(std::find(found.begin(), found.end(), getpid()), found.end()) << "not ourselves";
    EXPECT_EQ(std::find(found.begin(), found.end(), getppid()), found.end()) << "who started us runs another program";
}

}  // namespace
}  // namespace tessera
