#include "tests/support/words/Words.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <map>
#include <regex>
#include <string>
#include <vector>

namespace tessera::test {
namespace {

using Sentences = std::vector<std::string>;
using Sections = std::map<std::string, Sentences>;  // by the test

void replaceAll(std::string& text, std::string_view from, std::string_view to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
        text.replace(at, from.size(), to);
}

/// As a line of the file: without what differs between machines and runs.
std::string asLine(std::string_view text) {
    static const std::regex folder(R"([^\s'"`(]*/tessera-test-[A-Za-z0-9]{6})");
    static const std::regex port(R"(\b(127\.0\.0\.1|localhost):[3-6][0-9]{4}\b)");
    static const std::regex found(R"(near \([^)]*\))");  // whose last digits are the compiler's
    static const std::regex process(R"(/proc/[0-9]+)");
    static const std::regex place(R"(\b(byte|cut the file to|the last) [0-9]+)");  // behind paths, which have lengths
    std::string line;
    for (const char each : text) {
        if (each == '\n')
            line += "\\n";
        else if (each == '\\')
            line += "\\\\";
        else if (static_cast<unsigned char>(each) < 0x20)
            line += "\\x" + std::to_string(static_cast<unsigned char>(each));
        else
            line += each;
    }
    replaceAll(line, TESSERA_BIN_DIR, "BIN");
    replaceAll(line, TESSERA_SOURCE_DIR, "SOURCE");
    line = std::regex_replace(line, folder, "FOLDER");
    line = std::regex_replace(line, place, "$1 N");
    line = std::regex_replace(line, process, "/proc/PID");
    line = std::regex_replace(line, found, "near (PLACE)");
    return std::regex_replace(line, port, "$1:PORT");
}

std::string nameOf(const testing::TestInfo& test) {
    return std::string(test.test_suite_name()) + "." + test.name();
}

/// The file of this program, and what its tests have read so far.
class WordsFile : public testing::EmptyTestEventListener {
public:
    WordsFile() : path_(std::string(TESSERA_SOURCE_DIR "/tests/data/words/") + program_invocation_short_name + ".txt") {
        const char* const wish = std::getenv("TESSERA_WORDS");
        writes_ = wish != nullptr && std::string_view(wish) == "write";
        known_ = read();
    }

    testing::AssertionResult next(std::string_view text) {
        const testing::TestInfo* const test = testing::UnitTest::GetInstance()->current_test_info();
        if (test == nullptr) return testing::AssertionFailure() << "no test is running";
        const std::string said = asLine(text);
        const std::size_t index = read_.size();
        read_.push_back(said);
        if (writes_) return testing::AssertionSuccess();
        const auto section = known_.find(nameOf(*test));
        const bool more = section != known_.end() && index < section->second.size();
        if (more && section->second[index] == said) return testing::AssertionSuccess();
        return testing::AssertionFailure()
               << "sentence " << index + 1 << " is\n  " << said << "\nand in " << path_ << "\n  "
               << (more ? section->second[index] : "(none)")
               << "\nIf it is as it shall be: TESSERA_WORDS=write ./deploy/run-tests --only " << nameOf(*test);
    }

    void OnTestStart(const testing::TestInfo& /*test*/) override { read_.clear(); }
    void OnTestEnd(const testing::TestInfo& test) override {
        if (!test.result()->Passed()) return;
        const std::string name = nameOf(test);
        const auto section = known_.find(name);
        if (writes_) {
            if (section != known_.end() ? section->second != read_ : !read_.empty()) written_[name] = read_;
        } else if (section != known_.end() && section->second.size() != read_.size()) {
            ADD_FAILURE() << name << " read " << read_.size() << " sentences; " << path_ << " has "
                          << section->second.size();
        }
    }
    void OnTestProgramEnd(const testing::UnitTest& program) override {
        if (written_.empty()) return;
        // Another part of the program's tests may write, too.
        const int lock = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
        ::flock(lock, LOCK_EX);
        Sections all = read();
        for (const auto& [test, sentences] : written_) all[test] = sentences;
        std::ofstream file(path_);
        file << "# The sentences that tests of this program read (tests/support/words). TESSERA_WORDS=write writes "
                "them.\n";
        std::map<std::string, bool> there;
        for (int s = 0; s < program.total_test_suite_count(); ++s)
            for (int t = 0; t < program.GetTestSuite(s)->total_test_count(); ++t)
                there[nameOf(*program.GetTestSuite(s)->GetTestInfo(t))] = true;
        for (const auto& [test, sentences] : all) {
            if (sentences.empty() || !there.contains(test)) continue;
            file << '\n' << test << '\n';
            for (const std::string& sentence : sentences) file << "  " << sentence << '\n';
        }
        file.close();
        ::close(lock);
    }

private:
    [[nodiscard]] Sections read() const {
        Sections sections;
        std::ifstream file(path_);
        Sentences* section = nullptr;
        for (std::string line; std::getline(file, line);) {
            if (line.starts_with("  ") && section != nullptr)
                section->push_back(line.substr(2));
            else if (!line.empty() && !line.starts_with('#'))
                section = &sections[line];
        }
        return sections;
    }

    std::string path_;
    bool writes_ = false;
    Sections known_, written_;  ///< of the file; new ones
    Sentences read_;            ///< by the running test
};

WordsFile& wordsFile() {
    static auto* const file = [] {
        auto* const made = new WordsFile;
        testing::UnitTest::GetInstance()->listeners().Append(made);  // who has it for good
        return made;
    }();
    return *file;
}

// Before the first test, so that its start is heard, too.
[[maybe_unused]] const WordsFile& kAtStart = wordsFile();

}  // namespace

testing::AssertionResult isNextSentence(std::string_view text) {
    return wordsFile().next(text);
}

}  // namespace tessera::test
