/// What a benchmark that prints a table of its own leaves behind it: {"cases":[{"case","peer","ours",…}]}, as
/// SceneTable writes it and `plot.py` draws it.
#pragma once

#include <cstdio>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

namespace tessera::bench {

class CaseFile {
public:
    /// Where to, by `--json FILE`; without it nothing is written.
    CaseFile(int argc, char** argv) {
        for (int i = 1; i + 1 < argc; ++i)
            if (std::strcmp(argv[i], "--json") == 0) path_ = argv[i + 1];
    }

    /// `theirs` 0: nothing to compare with.
    void add(const std::string& name, const std::string& peer, double ours, double theirs, const std::string& unit) {
        cases_.push_back({{"case", name},
                          {"peer", peer},
                          {"ours", ours},
                          {"theirs", theirs},
                          {"unit", unit},
                          {"ratio", theirs > 0 ? ours / theirs : 0}});
    }

    /// The program's exit status.
    [[nodiscard]] int write() const {
        if (path_.empty()) return 0;
        std::ofstream out(path_);
        out << nlohmann::ordered_json{{"cases", cases_}}.dump(1) << "\n";
        out.close();
        if (out.good()) return 0;
        std::fprintf(stderr, "%s cannot be written\n", path_.c_str());
        return 1;
    }

private:
    std::string path_;
    nlohmann::ordered_json cases_ = nlohmann::ordered_json::array();
};

}  // namespace tessera::bench
