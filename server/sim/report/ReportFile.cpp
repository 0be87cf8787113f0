#include "server/sim/report/ReportFile.h"

#include <filesystem>
#include <fstream>

namespace tessera {

Expected<void> writeReport(const std::string& path, std::string_view text) {
    std::error_code error;
    std::filesystem::path target(path);
    if (std::filesystem::is_symlink(target, error))  // a link leads to the file
        if (const auto led = std::filesystem::weakly_canonical(target, error); !error) target = led;
    const std::filesystem::path temporary = target.string() + ".new";
    // What takes a device's name takes its place: --report /dev/null of a service would be the last of it.
    if (const auto there = std::filesystem::status(target, error);
        std::filesystem::exists(there) && !std::filesystem::is_regular_file(there))
        return fail(ErrorCode::kFailed, "cannot write the report " + path + ": it is no file");
    if (target.has_parent_path()) std::filesystem::create_directories(target.parent_path(), error);
    std::ofstream out(temporary, std::ios::binary);
    out.write(text.data(), static_cast<std::streamsize>(text.size()));
    out.close();
    if (!out)
        return fail(ErrorCode::kFailed,
                    "cannot write the report " + path + ": is the folder writable and the disk not full?");
    std::filesystem::rename(temporary, target, error);
    if (error) return fail(ErrorCode::kFailed, "cannot write the report " + path + ": " + error.message());
    return {};
}

}  // namespace tessera
