// The parent's side: a reader that crashes, spins, babbles or lies. Scripts play the reader.

#include <fmt/format.h>
#include <sys/stat.h>

#include <chrono>

#include "common/base/Hash.h"
#include "proto/scene.pb.h"
#include "server/import/Record.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

/// The error of an import by a script that stands for tessera-import.
class FakeImporter : public testing::Test {
protected:
    std::string errorWith(const std::string& script, std::chrono::milliseconds deadline = std::chrono::seconds(20),
                          const std::string& content = "x") {
        ImportOptions options = importOptions();
        options.importerProgram = scratch_.write("importer", "#!/bin/sh\n" + script);
        ::chmod(options.importerProgram.c_str(), 0700);
        options.deadline = deadline;
        const std::string model = scratch_.write("model.glb", content);
        const Expected<ImportedScene> scene = importScene(model, kRootNode, options);
        if (scene) return "(imported)";
        EXPECT_EQ(scene.error().message.compare(0, model.size() + 2, model + ": "), 0) << scene.error().message;
        return scene.error().message.substr(std::min(scene.error().message.size(), model.size() + 2));
    }

    /// A script that says these bytes.
    std::string say(const std::string& bytes) { return "cat '" + scratch_.write("answer", bytes) + "'\n"; }

    static std::string record(ImportRecord::Kind kind, const std::string& payload) {
        ImportRecord head;
        head.kind = kind;
        head.sizeBytes = payload.size();
        head.hash = hash64(asBytes(payload));
        return std::string(reinterpret_cast<const char*>(&head), sizeof(head)) + payload;
    }

    Scratch scratch_;
};

TEST_F(FakeImporter, ThatCrashesIsExplained) {
    EXPECT_EQ(errorWith("kill -SEGV $$"),
              "its reader crashed on it (segmentation fault: malformed, or nested too deeply)");
    EXPECT_EQ(errorWith("kill -ABRT $$"), "its reader gave up on it (aborted)");
    EXPECT_EQ(errorWith("kill -XCPU $$"),
              "it needs more than 10 s of processor time: 10 s, and 2 s for each MiB that was read");
    EXPECT_EQ(errorWith("kill -SYS $$"),
              "its reader tried a system call that is forbidden to it (network, processes or the like)");
    EXPECT_EQ(errorWith("kill -KILL $$"), "its reader was killed (out of memory, or by somebody)");
    EXPECT_EQ(errorWith("exit 7"), "its reader ended early without a result (exit code 7)");
}

TEST_F(FakeImporter, ThatNeedsTooMuchTimeIsToldWhichBoundHolds) {
    EXPECT_EQ(errorWith("kill -XCPU $$", std::chrono::seconds(20), std::string(5 << 20, ' ')),
              "it needs more than 20 s of processor time: 10 s, and 2 s for each MiB that was read");
    // A second more for each 4 MiB.
    EXPECT_EQ(errorWith("kill -XCPU $$", std::chrono::seconds(20), std::string(48 << 20, ' ')),
              "it needs more than 72 s of processor time, the most for a file of its size");
}

TEST_F(FakeImporter, ThatHangsIsEndedAtTheDeadline) {
    const auto start = std::chrono::steady_clock::now();
    EXPECT_EQ(errorWith("exec sleep 100", std::chrono::milliseconds(300)), "it takes longer than 0.3 s to read");
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
    // Bytes that keep coming don't help.
    EXPECT_EQ(errorWith("printf TSI1; while :; do sleep 0.05; printf '\\0'; done", std::chrono::milliseconds(300)),
              "it takes longer than 0.3 s to read");
}

TEST_F(FakeImporter, ThatBabblesIsNotBelieved) {
    EXPECT_EQ(errorWith("yes"), "its reader's answer is damaged (not a record)");
    EXPECT_EQ(errorWith(say("TSI1")), "its reader ended early without a result (exit code 0)");
    EXPECT_EQ(errorWith(say(record(ImportRecord::Kind::kEnd, ""))), "its reader's answer is damaged (no scene)");
    EXPECT_EQ(errorWith(say(record(static_cast<ImportRecord::Kind>(77), ""))),
              "its reader's answer is damaged (unknown record)");
    const std::string scene = record(ImportRecord::Kind::kScene, "");
    EXPECT_EQ(errorWith(say(scene + scene)), "its reader's answer is damaged (two scenes)");
    EXPECT_EQ(errorWith(say(scene + record(ImportRecord::Kind::kEnd, ""))), "there is nothing in it to show");
    std::string wrongHash = record(ImportRecord::Kind::kBlob, "abcd");
    wrongHash.back() = 'X';
    EXPECT_EQ(errorWith(say(wrongHash)), "its reader's answer is damaged (wrong hash)");
    EXPECT_EQ(errorWith(say(record(ImportRecord::Kind::kScene, "\xff\xff\xff") + record(ImportRecord::Kind::kEnd, ""))),
              "it is not a Tessera scene, or damaged");
}

TEST_F(FakeImporter, ThatPromisesTooMuchIsRefusedBeforeMemoryIsTaken) {
    ImportRecord head;
    head.kind = ImportRecord::Kind::kBlob;
    head.sizeBytes = std::uint64_t{1} << 62;
    EXPECT_EQ(errorWith(say(std::string(reinterpret_cast<const char*>(&head), sizeof(head)))),
              "it becomes more than 1024 MiB in memory");
}

TEST_F(FakeImporter, CannotWriteToTheTerminal) {
    const std::string message = std::string(1, static_cast<char>(ErrorCode::kBadInput)) + "\x1b[2Jgone\n";
    EXPECT_EQ(errorWith(say(record(ImportRecord::Kind::kError, message))), " [2Jgone ");
}

TEST_F(FakeImporter, ThatIsMissingIsNamed) {
    ImportOptions options = importOptions();
    options.importerProgram = scratch_.path("nowhere/tessera-import");
    const Expected<ImportedScene> scene = importScene(scratch_.write("m.glb", "x"), kRootNode, options);
    ASSERT_FALSE(scene);
    EXPECT_WORDS(scene.error().message);
}

TEST_F(FakeImporter, SceneThatIsNotInPlainFormIsRefused) {
    // A box, a mesh whose array does not exist, and indices beyond the vertices.
    proto::scene::SceneFile box;
    box.add_node()->mutable_box()->mutable_size()->set_x(1);
    const std::string end = record(ImportRecord::Kind::kEnd, "");
    EXPECT_WORDS(errorWith(say(record(ImportRecord::Kind::kScene, box.SerializeAsString()) + end)));

    proto::scene::SceneFile file;
    file.add_node()->mutable_geometry()->set_mesh("m");
    proto::scene::Mesh* mesh = file.add_mesh();
    mesh->set_name("m");
    mesh->set_positions_blob(1);
    mesh->set_indices_blob(2);
    EXPECT_WORDS(errorWith(say(record(ImportRecord::Kind::kScene, file.SerializeAsString()) + end)));
    const std::string positions(36, '\0');
    const std::string indices("\0\0\0\0\1\0\0\0\x63\0\0\0", 12);
    const std::string wrong =
        errorWith(say(record(ImportRecord::Kind::kScene, file.SerializeAsString()) +
                      record(ImportRecord::Kind::kBlob, positions) + record(ImportRecord::Kind::kBlob, indices) + end));
    EXPECT_WORDS(wrong);
}

}  // namespace
}  // namespace tessera
