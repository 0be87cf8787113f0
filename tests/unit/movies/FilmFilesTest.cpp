// Which files films come from, whatever is swapped while they are opened.
#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "server/sim/desk/FilmFiles.h"
#include "tests/unit/TestFolder.h"

namespace tessera::test {
namespace {

namespace fs = std::filesystem;

class FilmFiles : public testing::Test {
protected:
    FilmFiles() {
        fs::create_directories(root_ + "/allowed/films");
        fs::create_directories(root_ + "/secret");
        std::ofstream(root_ + "/allowed/films/a.mkv") << "film";
        std::ofstream(root_ + "/secret/a.mkv") << "secret";
        fs::create_directory_symlink(root_ + "/secret", root_ + "/allowed/link");
    }
    [[nodiscard]] std::string read(const std::string& name) const {
        const Expected<FileHandle> film = open_(root_ + "/allowed/" + name);
        char content[16] = {};
        return film ? std::string(content, static_cast<std::size_t>(
                                               std::max<ssize_t>(::read(film->get(), content, sizeof content), 0)))
                    : "refused";
    }
    TestFolder folder_;
    std::string root_ = fs::canonical(folder_.path()).string();
    Movies::Opener open_ = filmOpener(std::make_shared<SceneFiles>(ImportOptions(), std::vector{root_ + "/allowed"}));
};

TEST_F(FilmFiles, AreOrdinaryOnesInTheFoldersThatMayBeRead) {
    EXPECT_EQ(read("films/a.mkv"), "film");
    EXPECT_EQ(read("films/../films/a.mkv"), "film");
    ASSERT_EQ(::mkfifo((root_ + "/allowed/pipe.mkv").c_str(), 0600), 0);
    for (const char* name :
         {"link/a.mkv", "films/../../secret/a.mkv", "../secret/a.mkv", "films", "none.mkv", "pipe.mkv"})
        EXPECT_EQ(read(name), "refused") << name;
}

TEST_F(FilmFiles, AreNotThoseOfAFolderThatHasBecomeALink) {
    std::atomic<bool> stop = false;
    std::thread swapping([&] {
        const std::string a = root_ + "/allowed/films", b = root_ + "/allowed/link";
        while (!stop) ::syscall(SYS_renameat2, AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), 2u /* RENAME_EXCHANGE */);
    });
    int right = 0, astray = 0;
    for (int i = 0; i < 10'000; ++i) {
        const std::string content = read("films/a.mkv");
        right += content == "film";
        astray += content == "secret";
    }
    stop = true;
    swapping.join();
    EXPECT_EQ(astray, 0);
    EXPECT_GT(right, 0);
}

}  // namespace
}  // namespace tessera::test
