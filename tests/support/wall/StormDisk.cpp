#include "tests/support/wall/StormDisk.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <vector>

namespace tessera::simulation {

std::string damageSector(const std::filesystem::path& folder, Random& random) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.is_regular_file() && entry.path().filename() != "lock" && entry.file_size() > 0)
            files.push_back(entry.path());
    if (files.empty()) return "nothing";
    std::ranges::sort(files);  // logs have names in their order
    const std::filesystem::path path = random.below(2) == 0 ? files.back() : files[random.below(files.size())];
    std::ifstream in(path, std::ios::binary);
    std::string bytes(std::istreambuf_iterator<char>(in), {});
    const std::size_t sector = random.below(2) == 0 ? 512 : 4096;
    const auto place = [&] { return random.below((bytes.size() + sector - 1) / sector) * sector; };
    const std::size_t at = place(), count = std::min(sector, bytes.size() - at);
    const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    std::string what;
    switch (random.below(6)) {
        case 0:
            what = "a bit flipped in";
            from[static_cast<std::ptrdiff_t>(random.below(count))] ^= static_cast<char>(1 << random.below(8));
            break;
        case 1:
            what = "noise over";
            std::generate_n(from, count, [&] { return static_cast<char>(random.next()); });
            break;
        case 2:
            what = "another sector over";
            bytes.replace(at, count, bytes.substr(place(), count));
            break;
        case 3:
            what = "doubled";
            bytes.insert(at, bytes.substr(at, count));
            break;
        case 4:
            what = "left out";
            bytes.erase(at, count);
            break;
        default:
            what = "zeroed";
            std::fill_n(from, count, '\0');
    }
    std::ofstream(path, std::ios::binary) << bytes;
    return fmt::format("{} {} bytes at {} of {}", what, count, at, path.filename().string());
}

void restoreFolder(const std::filesystem::path& folder, const std::filesystem::path& copy) {
    std::filesystem::remove_all(folder);
    std::filesystem::copy(copy, folder, std::filesystem::copy_options::recursive);
}

}  // namespace tessera::simulation
