#include "tests/architecture/SourceFile.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>

namespace tessera::architecture {

namespace fs = std::filesystem;

std::string withoutComments(const std::string& text, bool blankLiterals) {
    std::string out = text;
    const auto blank = [&](std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < to && i < out.size(); ++i) {
            if (out[i] != '\n') out[i] = ' ';
        }
    };
    const auto isWord = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
    std::size_t i = 0;
    while (i < text.size()) {
        if (text.compare(i, 2, "//") == 0) {
            std::size_t end = text.find('\n', i);
            end = end == std::string::npos ? text.size() : end;
            blank(i, end);
            i = end;
        } else if (text.compare(i, 2, "/*") == 0) {
            std::size_t end = text.find("*/", i + 2);
            end = end == std::string::npos ? text.size() : end + 2;
            blank(i, end);
            i = end;
        } else if (text.compare(i, 2, "R\"") == 0 && (i == 0 || !isWord(text[i - 1]))) {
            const std::size_t open = std::min(text.find('(', i), text.size() - 1);
            const std::string close = fmt::format("){}\"", text.substr(i + 2, open - i - 2));
            std::size_t end = text.find(close, open);
            end = end == std::string::npos ? text.size() : end + close.size();
            if (blankLiterals) blank(i + 2, end - 1);
            i = end;
        } else if (text[i] == '"' || (text[i] == '\'' && (i == 0 || !isWord(text[i - 1])))) {  // 1'000 is no literal
            const char quote = text[i];
            std::size_t end = i + 1;
            while (end < text.size() && text[end] != quote && text[end] != '\n') end += text[end] == '\\' ? 2 : 1;
            if (blankLiterals) blank(i + 1, end);
            i = end + 1;
        } else {
            ++i;
        }
    }
    return out;
}

SourceFile readSource(const fs::path& root, const std::string& path) {
    std::ifstream in(root / path, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    SourceFile file;
    file.path = path;
    file.folder = fs::path(path).parent_path().generic_string();
    file.lines =
        static_cast<int>(std::count(text.begin(), text.end(), '\n')) + (!text.empty() && text.back() != '\n' ? 1 : 0);
    file.code = withoutComments(text, true);

    static const std::regex pattern(R"rx(^\s*#\s*include\s*([<"])([^>"]+)[>"])rx");
    std::istringstream lines(withoutComments(text, false));
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
        std::smatch match;
        if (std::regex_search(line, match, pattern)) {
            file.includes.push_back({.path = match[2], .quoted = match[1] == "\"", .line = number});
        }
    }
    return file;
}

std::vector<std::string> pathsBelow(const fs::path& root, const std::vector<std::string>& folders,
                                    const std::vector<std::string>& endings) {
    std::vector<std::string> paths;
    for (const std::string& folder : folders) {
        if (!fs::exists(root / folder)) continue;
        for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / folder))
            if (entry.is_regular_file() &&
                std::ranges::find(endings, entry.path().extension().string()) != endings.end())
                paths.push_back(fs::relative(entry.path(), root).generic_string());
    }
    std::sort(paths.begin(), paths.end());
    return paths;
}

std::vector<SourceFile> readTree(const fs::path& root, const std::vector<std::string>& folders) {
    std::vector<SourceFile> files;
    for (const std::string& path : pathsBelow(root, folders, {".h", ".inl", ".cpp"}))
        files.push_back(readSource(root, path));
    return files;
}

}  // namespace tessera::architecture
