/// Logs become a snapshot: the same journal, made without its arrays in memory.
#include <sys/wait.h>
#include <unistd.h>

#include "common/cores/ApplicationData.h"
#include "server/sim/journal/JournalCompaction.h"
#include "server/sim/journal/JournalReader.h"
#include "server/sim/journal/JournalStory.h"
#include "tests/unit/Sanitized.h"
#include "tests/unit/journal/KeptShow.h"

namespace tessera {
namespace {

constexpr FieldId kData = fieldId<&ApplicationData::data>;

Blob someBytes(Random& random, std::size_t count) {
    Bytes bytes(count);
    for (std::size_t at = 0; at < count; at += sizeof(std::uint64_t)) {
        const std::uint64_t value = random();
        std::memcpy(bytes.data() + at, &value, std::min(sizeof value, count - at));
    }
    return Blob(std::move(bytes));
}

/// A simulation whose objects have arrays and nothing else, and its journal.
class ArrayShow {
public:
    explicit ArrayShow(Random& random) : random_(random) {}

    /// A server that begins, or goes on.
    void begin(const std::string& folder) {
        JournalLimits never;
        never.compactBytes = std::uint64_t{1} << 40;
        Expected<Journal::Opened> opened = test::openJournal(folder, arrays_, words.log, never);
        ASSERT_TRUE(opened) << opened.error().message;
        journal_ = std::move(opened->journal);
        next_ = opened->state.nextFrame;
        gestures_ += 1'000;
        simulation = std::make_unique<Simulation>();
        test::goOn(*simulation, *opened);
    }
    void end() {
        journal_->ends(next_);
        ASSERT_TRUE(test::waitUntilWritten(*journal_));
        ASSERT_FALSE(journal_->trouble()) << journal_->trouble()->message;
        journal_.reset();
    }
    void frame(std::vector<Edit> edits) {
        const FrameResult result = simulation->step(next_ == FrameNumber(0), std::move(edits));
        for (const EditOutcome& outcome : result.outcomes) done += outcome.result ? 1 : 0;
        journal_->frameDone(next_, result, simulation->display());
        next_ = next_.next();
    }

    [[nodiscard]] static Edit add(Blob data) {
        test::ListMaker make;
        const ObjectId core = make.create<ApplicationData>();
        make.builder.set(core, typeOf<ApplicationData>(), kData, std::move(data));
        make.node("keeper", kRootNode, core);
        return {.list = make.builder.take()};
    }
    [[nodiscard]] Edit setWhole(ObjectId core, Blob data) const {
        ChangeListBuilder builder;
        builder.set(core, typeOf<ApplicationData>(), kData, std::move(data));
        return {.list = builder.take()};
    }
    [[nodiscard]] Edit setRange(ObjectId core, std::uint64_t offset, Blob bytes) const {
        ChangeListBuilder builder;
        builder.setRange(core, typeOf<ApplicationData>(), kData, offset, std::move(bytes));
        return {.list = builder.take(), .gesture = {1, gestures_}};
    }
    [[nodiscard]] std::vector<ObjectId> cores() const {
        std::vector<ObjectId> all;
        for (const ObjectId id : simulation->scene().ids())
            if (simulation->scene().get<ApplicationData>(id)) all.push_back(id);
        return all;
    }
    [[nodiscard]] const Blob& dataOf(ObjectId core) const {
        return simulation->scene().get<ApplicationData>(core)->data;
    }

    /// One edit as a bad day brings it: of arrays of all sizes about those of leaves, ranges of all lengths, objects
    /// that go, steps back and forth.
    [[nodiscard]] Edit someEdit() {
        const std::vector<ObjectId> known = cores();
        const std::size_t what = below(random_, 12);
        if (known.empty() || what == 0) return add(someArray());
        const ObjectId core = known[below(random_, known.size())];
        const Blob& data = dataOf(core);
        if (oneIn(random_, 3)) ++gestures_;
        switch (what) {
            case 1:
                return setWhole(core, someArray());
            case 2:
                return setWhole(core, dataOf(known[below(random_, known.size())]));  // as a copy has it
            case 3: {
                ChangeListBuilder builder;
                for (const ObjectId id : simulation->scene().ids()) {
                    const Node* node = simulation->scene().get<Node>(id);
                    if (!node || node->core != core) continue;
                    builder.detach(id);
                    builder.destroy(id);
                }
                builder.destroy(core);
                return {.list = builder.take()};
            }
            case 4:
            case 5:
                return {.kind = Edit::Kind::kUndo};
            case 6:
                return {.kind = Edit::Kind::kRedo};
            case 7: {  // a range of an array that the same list sets
                const Blob fresh = someArray();
                ChangeListBuilder builder;
                builder.set(core, typeOf<ApplicationData>(), kData, fresh);
                builder.setRange(core, typeOf<ApplicationData>(), kData, fresh.sizeBytes() / 2,
                                 someBytes(random_, fresh.sizeBytes() - fresh.sizeBytes() / 2));
                return {.list = builder.take()};
            }
            default: {
                if (data.sizeBytes() == 0) return add(someArray());
                const std::size_t offset = oneIn(random_, 4) ? 0 : below(random_, data.sizeBytes());
                const std::size_t most = data.sizeBytes() - offset;
                Edit edit =
                    setRange(core, offset, someBytes(random_, oneIn(random_, 4) ? most : 1 + below(random_, most)));
                edit.undoable = !oneIn(random_, 4);
                return edit;
            }
        }
    }

    std::unique_ptr<Simulation> simulation;
    test::ReadableLog words;
    int done = 0;

private:
    [[nodiscard]] Blob someArray() {
        constexpr std::array<std::size_t, 6> kSizes{
            1, 40, 5'000, kBlobLeafBytes - 1, kBlobLeafBytes, 3 * kBlobLeafBytes};
        return someBytes(random_, kSizes[below(random_, kSizes.size())] + below(random_, 3));
    }

    Random& random_;
    BlobStore arrays_;
    std::unique_ptr<Journal> journal_;
    FrameNumber next_;
    std::uint64_t gestures_ = 1;
};

/// All that a server goes on from, read with its arrays.
struct Read {
    std::unique_ptr<BlobStore> arrays = std::make_unique<BlobStore>();
    JournalState state;
};
Read readAll(const JournalFolder& folder) {
    Read read;
    const Expected<JournalFiles> files = folder.files();
    EXPECT_TRUE(files);
    Expected<JournalStory> story = readJournal(folder, *files, *read.arrays, {});
    EXPECT_TRUE(story) << story.error().message;
    if (story) read.state = std::move(story->state);
    return read;
}

void expectSame(const Read& before, const Read& after) {
    EXPECT_EQ(after.state.sequence, before.state.sequence);
    EXPECT_EQ(after.state.nextFrame, before.state.nextFrame);
    EXPECT_EQ(after.state.epoch, before.state.epoch);
    EXPECT_EQ(after.state.numbers->nextId, before.state.numbers->nextId);
    ASSERT_EQ(after.state.scene.stateHash(), before.state.scene.stateHash());
    EXPECT_EQ(snapshot(after.state.scene), snapshot(before.state.scene));
    for (const Blob& array : blobsOf(snapshot(after.state.scene))) {
        ASSERT_TRUE(array.resident());
        EXPECT_EQ(blobIdOf(array.bytes()), array.id());
    }
    const std::vector<EditHistory::Kept> was = before.state.history.kept(), is = after.state.history.kept();
    EXPECT_EQ(after.state.history.bytes(), before.state.history.bytes());
    ASSERT_EQ(is.size(), was.size());
    for (std::size_t step = 0; step < is.size(); ++step) {
        EXPECT_EQ(is[step].place, was[step].place);
        EXPECT_EQ(is[step].gesture, was[step].gesture);
        ASSERT_EQ(is[step].lists.size(), was[step].lists.size());
        for (std::size_t list = 0; list < is[step].lists.size(); ++list) {
            EXPECT_EQ(*is[step].lists[list], *was[step].lists[list]);
            for (const RangeEdit& range : is[step].lists[list]->ranges) EXPECT_TRUE(range.bytes.resident());
        }
    }
}

/// Both ways of reading lead to the same, step by step back to the beginning.
void expectSameWayBack(Read before, Read after) {
    Simulation one, other;
    one.goOnFrom(test::leftIn(before.state));
    other.goOnFrom(test::leftIn(after.state));
    while (one.history().undoDepth() > 0 || one.stepUnderWay()) {
        for (Simulation* simulation : {&one, &other}) {
            const FrameResult result = simulation->step(false, std::vector<Edit>(1, Edit{.kind = Edit::Kind::kUndo}));
            ASSERT_TRUE(result.outcomes.at(0).result) << result.outcomes[0].result.error().message;
        }
        ASSERT_EQ(other.scene().stateHash(), one.scene().stateHash());
    }
    EXPECT_EQ(other.history().undoDepth(), 0u);
}

TEST(JournalCompaction, LeadsToTheSameSceneAndTheSameHistory) {
    int done = 0, compactions = 0;
    forSeeds(16, [&](Random& random) {
        const test::TestFolder folder;
        ArrayShow show(random);
        for (int server = 0; server < 3; ++server) {
            ASSERT_NO_FATAL_FAILURE(show.begin(folder / "wall"));
            for (int frame = 0; frame < 60; ++frame) {
                std::vector<Edit> edits;
                for (std::size_t count = below(random, 3); count > 0; --count) edits.push_back(show.someEdit());
                show.frame(std::move(edits));
            }
            const StateHash reached = show.simulation->scene().stateHash();
            ASSERT_NO_FATAL_FAILURE(show.end());
            const Expected<JournalFolder> held =
                JournalFolder::hold(folder / "wall", std::make_shared<test::UnsyncedDisk>());
            ASSERT_TRUE(held) << held.error().message;
            const std::uint64_t last = held->files()->lastLog();
            if (server == 0 || oneIn(random, 3)) continue;
            Read before = readAll(*held);
            ASSERT_EQ(before.state.scene.stateHash(), reached);
            const Expected<std::uint64_t> bytes = compactJournal(*held, last, {}, false);
            ASSERT_TRUE(bytes) << bytes.error().message;
            ++compactions;
            EXPECT_EQ(test::filesIn(folder / "wall").size(), 2u);
            EXPECT_EQ(*bytes, std::filesystem::file_size(held->snapshotPath(last)));
            Read after = readAll(*held);
            ASSERT_NO_FATAL_FAILURE(expectSame(before, after));
            ASSERT_NO_FATAL_FAILURE(expectSameWayBack(std::move(before), std::move(after)));
        }
        done += show.done;
        EXPECT_EQ(show.words.said(), "");
    });
    if (!testing::Test::HasFailure() && !std::getenv("TESSERA_SEED")) {
        EXPECT_GT(done, 1'000);
        EXPECT_GT(compactions, 10);
    }
}

/// Runs `work` in a process of its own and gives the text that it gives.
template <typename Work>
std::string inAProcessOfItsOwn(const Work& work) {
    std::array<int, 2> ends{};
    EXPECT_EQ(::pipe(ends.data()), 0);
    const pid_t child = ::fork();
    if (child == 0) {
        const std::string text = work();
        (void)!::write(ends[1], text.data(), text.size());
        ::_exit(testing::Test::HasFailure() ? 1 : 0);
    }
    ::close(ends[1]);
    std::string text(4096, '\0');
    std::size_t got = 0;
    for (ssize_t part = 0; (part = ::read(ends[0], text.data() + got, text.size() - got)) > 0;)
        got += static_cast<std::size_t>(part);
    text.resize(got);
    ::close(ends[0]);
    int status = 0;
    EXPECT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    return text;
}

/// In KiB, since `writePeak` at most.
std::uint64_t peakOfMemory() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.starts_with("VmHWM:")) return std::stoull(line.substr(6));
    ADD_FAILURE() << "the kernel does not tell";
    return 0;
}

/// 200 MiB of arrays, a tenth of them edited by ranges, and a history that names as much again.
TEST(JournalCompaction, HoldsNoArrays) {
    constexpr std::size_t kArrays = 40, kArrayBytes = std::size_t{5} << 20, kMostGrowth = std::size_t{32} << 20;
    const test::TestFolder folder;
    const std::string reached = inAProcessOfItsOwn([&] {
        Random random(1);
        ArrayShow show(random);
        [&] { ASSERT_NO_FATAL_FAILURE(show.begin(folder / "wall")); }();
        for (std::size_t i = 0; i < kArrays; ++i) show.frame({ArrayShow::add(someBytes(random, kArrayBytes))});
        const std::vector<ObjectId> cores = show.cores();
        for (std::size_t i = 0; i < kArrays; ++i) {
            const std::vector<Edit> edits =
                i % 2 == 0 ? std::vector{show.setWhole(cores[i], someBytes(random, kArrayBytes))}
                           : std::vector{show.setRange(cores[i], 1'234'567, someBytes(random, kArrayBytes / 2))};
            show.frame(edits);
        }
        EXPECT_EQ(show.done, static_cast<int>(2 * kArrays));
        const std::string hash = toHex(show.simulation->scene().stateHash());
        [&] { ASSERT_NO_FATAL_FAILURE(show.end()); }();
        return hash;
    });
    ASSERT_EQ(reached.size(), 16u);
    const Expected<JournalFolder> held = JournalFolder::hold(folder / "wall", std::make_shared<test::UnsyncedDisk>());
    ASSERT_TRUE(held) << held.error().message;
    // The snapshot is of all before this one.
    ASSERT_TRUE(held->beginLog({.schema = schemaHash(),
                                .program = "unit_journal",
                                .number = 2,
                                .epoch = {},
                                .scenes = {},
                                .sequence = {},
                                .stateHash = {}}));
    ASSERT_GT(std::filesystem::file_size(held->logPath(1)), kArrays * kArrayBytes);
    const std::string grown = inAProcessOfItsOwn([&] {
        std::ofstream("/proc/self/clear_refs") << "5";
        const std::uint64_t before = peakOfMemory();
        const Expected<std::uint64_t> bytes = compactJournal(*held, 2, {}, false);
        EXPECT_TRUE(bytes) << bytes.error().message;
        EXPECT_GT(*bytes, kArrays * kArrayBytes);
        return std::to_string((peakOfMemory() - before) << 10);
    });
    if (!kSanitized) {
        EXPECT_LT(std::stoull(grown), kMostGrowth);
    }
    BlobStore arrays;
    Expected<JournalReader> reader = JournalReader::open(held->snapshotPath(2), arrays);
    ASSERT_TRUE(reader);
    std::string found;
    for (Expected<std::optional<JournalRecord>> record = reader->next(); record && *record; record = reader->next())
        if (const auto* state = std::get_if<journal::State>(&**record)) found = toHex(state->stateHash);
    EXPECT_EQ(found, reached);
}

TEST(JournalCompaction, BytesThatChangeInTheirFileAreNoticed) {
    // Arrays of files that the snapshot's maker has read once already: the second time they are others.
    const test::TestFolder folder;
    Random random(4);
    ArrayShow show(random);
    ASSERT_NO_FATAL_FAILURE(show.begin(folder / "wall"));
    show.frame({ArrayShow::add(someBytes(random, 3'000'000)), ArrayShow::add(someBytes(random, 3'000'000))});
    show.frame({show.setRange(show.cores()[1], 1'000'000, someBytes(random, 1'000'000))});
    ASSERT_NO_FATAL_FAILURE(show.end());
    ASSERT_NO_FATAL_FAILURE(show.begin(folder / "wall"));
    ASSERT_NO_FATAL_FAILURE(show.end());

    const std::string log = folder / "wall/log-0000000001";
    std::ifstream in(log, std::ios::binary);
    const std::string content(std::istreambuf_iterator<char>(in), {});
    // In the first array; in the second before and behind its range; in the bytes of the range; in those that lead
    // back.
    for (const std::uint64_t at : {1'000, 2'900'000, 3'500'000, 5'500'000, 6'500'000, 7'500'000}) {
        /// Damages the log when the snapshot is begun: all has been read by then.
        class Spoiling : public test::UnsyncedDisk {
        public:
            Spoiling(std::string log, std::uint64_t at) : log_(std::move(log)), at_(at) {}
            int create(const std::string& path, int& file) override {
                if (path.find("snapshot") != std::string::npos) {
                    std::fstream spoilt(log_, std::ios::in | std::ios::out | std::ios::binary);
                    spoilt.seekp(static_cast<std::streamoff>(at_));
                    spoilt.put('x').put('y').put('z');
                }
                return FileSystem::create(path, file);
            }

        private:
            std::string log_;
            std::uint64_t at_;
        };
        const Expected<JournalFolder> held = JournalFolder::hold(folder / "wall", std::make_shared<Spoiling>(log, at));
        ASSERT_TRUE(held) << held.error().message;
        const Expected<std::uint64_t> bytes = compactJournal(*held, 2, {}, false);
        EXPECT_FALSE(bytes) << "byte " << at;
        EXPECT_EQ(test::filesIn(folder / "wall").size(), 2u);
        std::ofstream(log, std::ios::binary) << content;
    }
    const Expected<JournalFolder> held = JournalFolder::hold(folder / "wall", std::make_shared<test::UnsyncedDisk>());
    EXPECT_TRUE(compactJournal(*held, 2, {}, false));
}

}  // namespace
}  // namespace tessera
