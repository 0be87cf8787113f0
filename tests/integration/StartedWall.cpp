#include "tests/integration/StartedWall.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "tests/unit/Eventually.h"

namespace tessera::test {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

std::vector<pid_t> clientsWith(const std::string& word) {
    std::vector<pid_t> found;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator("/proc", ignored)) {
        const std::string name = entry.path().filename();
        if (name.find_first_not_of("0123456789") != std::string::npos) continue;
        const std::string line = readText(entry.path() / "cmdline");
        if (line.starts_with(program("tessera-client")) && line.find(word) != std::string::npos)
            found.push_back(std::stoi(name));
    }
    return found;
}

std::string StartedWall::me() {
    const char* name = ::geteuid() == 0 ? "root" : ::getenv("USER");
    return name ? name : "root";
}

std::string StartedWall::machineAt(const SshServer& sshd, const std::string& more, int port) {
    return fmt::format("machine {{ ssh: \"{}@{}\" port: {} {} }}", me(), sshd.address(), port != 0 ? port : sshd.port(),
                       more);
}

std::string StartedWall::client(const std::string& path) {
    return fmt::format("command: \"{}\"", path);
}

std::string StartedWall::wallOf(const std::string& left, const std::string& right) {
    return folder_.write("lab.wall", fmt::format(R"(
screens {{ name: "front" lower_left {{ x: -1.6 y: 0.6 }} lower_right {{ x: 1.6 y: 0.6 }} upper_left {{ x: -1.6 y: 2.4 }}
  grid {{ columns: 2 rows: 1 tile_width_px: 120 tile_height_px: 100 }} }}
users {{ name: "viewer" position {{ y: 1.7 z: 2.4 }} }}
hosts {{ name: "west" tiles {{ screen: "front" column: 0 user: "viewer" }} {} }}
hosts {{ name: "east" tiles {{ screen: "front" column: 1 user: "viewer" }} {} }}
sync {{ late_frame: WAIT frame_deadline_ms: 10000 heartbeat_ms: 100 lost_after_ms: 800 start_deadline_ms: 20000 }}
samples: 1
)",
                                                 left, right));
}

std::vector<std::string> StartedWall::command(const SshServer& sshd, const std::string& wall,
                                              std::vector<std::string> more) const {
    std::vector<std::string> words = {program("tessera-wall"), "--wall",  wall,    "--scene",    kYard, "--output",
                                      folder_.path() + "/out", "--start", "--ssh", sshd.client()};
    words.insert(words.end(), more.begin(), more.end());
    return words;
}

Picture StartedWall::picture(const std::string& file) {
    const Expected<Bytes> bytes = readFile(file, 100 << 20);
    if (!bytes) {
        ADD_FAILURE() << bytes.error().message;
        return {};
    }
    return decodePng(*bytes).value().picture;
}

bool StartedWall::allGone(std::chrono::milliseconds patience) {
    return eventually([] { return clientsWith("--while-input").empty(); }, patience);
}

}  // namespace tessera::test
