#include "server/tools/walls/ForeignWall.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "common/codec/WallCodec.h"
#include "common/output/MeshFile.h"

namespace tessera {

std::string wallName(std::string_view text, std::set<std::string>& taken) {
    std::string name;
    for (const char c : text.substr(0, 40))
        name += std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' || (c == '.' && !name.empty())
                    ? c
                    : '-';
    if (name.empty()) name = "unnamed";
    const std::string base = name;
    // A file may call all things alike: after some tries the numbers leap.
    for (std::size_t next = 2; !taken.insert(name).second;
         next = next < 16 ? next + 1 : std::max(next + 1, taken.size()))
        name = fmt::format("{}-{}", base, next);
    return name;
}

Screen screenOf(const std::string& name, const Vec3d& corner, const Vec3d& right, const Vec3d& up) {
    Screen screen{.name = name};
    screen.lowerLeft = corner;
    screen.lowerRight = corner + right;
    screen.upperLeft = corner + up;
    return screen;
}

Expected<void> saveForeignWall(const ForeignWall& made, const std::string& path) {
    const std::filesystem::path out(path);
    const auto write = [](const std::filesystem::path& to, std::string_view bytes) -> Expected<void> {
        // A wall that is there stays whole where the disk is full; a link leads to the file.
        std::error_code unknown;
        const std::filesystem::path led = std::filesystem::weakly_canonical(to, unknown);
        if (std::filesystem::exists(led, unknown) && !std::filesystem::is_regular_file(led, unknown))
            return fail(ErrorCode::kFailed, fmt::format("{}: cannot be written: it is no file", to.string()));
        const std::filesystem::path unfinished = fmt::format("{}.{}.new", led.string(), ::getpid());
        std::ofstream file(unfinished, std::ios::binary);
        file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        file.close();
        const int why = errno;
        std::error_code error;
        if (file) std::filesystem::rename(unfinished, led, error);
        if (file && !error) return {};
        const std::string reason = error ? error.message() : std::strerror(why);
        std::filesystem::remove(unfinished, error);
        return fail(ErrorCode::kFailed, fmt::format("{}: cannot be written: {}", to.string(), reason));
    };
    Wall named = made.wall;
    for (WallHost& host : named.hosts)
        for (TileAssignment& tile : host.tiles)
            for (std::string* name : {&tile.output.warpFile, &tile.output.blendFile})
                if (!name->empty()) *name = out.stem().string() + "-" + *name;
    const Expected<std::string> itself = wallText(named);
    if (!itself) return failWith(path, itself.error());
    for (const WallHost& host : named.hosts) {
        for (const TileAssignment& tile : host.tiles) {
            const TileOutput& output = tile.output;
            if (output.warp) {
                const std::string mesh = meshText(*output.warp, static_cast<double>(output.widthPx) / output.heightPx);
                if (auto ok = write(out.parent_path() / output.warpFile, mesh); !ok) return ok;
            }
            if (!output.blendPicture) continue;
            if (auto ok = write(out.parent_path() / output.blendFile, asText(*output.blendPicture)); !ok) return ok;
        }
    }
    std::string text = fmt::format("# From a description for {}, by tessera-convert.\n", made.source);
    // A note quotes the file: whatever that says must not end the comment.
    for (std::string note : made.notes) {
        std::ranges::replace_if(
            note, [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
        text += "# " + note + "\n";
    }
    return write(out, text + *itself);
}

}  // namespace tessera
