#include "common/net/PortHolder.h"

#include <dirent.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>

#include <fmt/format.h>

namespace tessera {
namespace {

struct ListeningSocket {
    std::string inode;
    std::string user;
};

/// One of a table as /proc/net/tcp (proc(5)): number, local address:port in hex, remote, state, …, user, timeout,
/// inode.
std::optional<ListeningSocket> listeningIn(const char* table, std::uint16_t port) {
    std::ifstream in(table);
    const std::string wanted = fmt::format("{:04X}", port);
    for (std::string line; std::getline(in, line);) {
        std::istringstream words(line);
        std::string number, local, remote, state, queues, timer, retransmits, user, timeout, inode;
        if (!(words >> number >> local >> remote >> state >> queues >> timer >> retransmits >> user >> timeout >>
              inode))
            continue;
        constexpr const char* kListen = "0A";
        if (state == kListen && local.ends_with(":" + wanted)) return ListeningSocket{inode, user};
    }
    return std::nullopt;
}

template <typename Found>
void forEachIn(const std::string& folder, Found&& found) {
    DIR* listing = ::opendir(folder.c_str());
    if (!listing) return;
    while (const dirent* entry = ::readdir(listing))
        if (found(std::string(entry->d_name))) break;
    ::closedir(listing);
}

/// The process that has the socket open; empty: none that we may look at.
std::string processWith(const std::string& inode) {
    const std::string wanted = "socket:[" + inode + "]";
    std::string holder;
    forEachIn("/proc", [&](const std::string& pid) {
        if (!std::ranges::all_of(pid, [](char c) { return c >= '0' && c <= '9'; })) return false;
        const std::string files = "/proc/" + pid + "/fd";
        forEachIn(files, [&](const std::string& file) {
            std::array<char, 64> target{};
            const ssize_t length = ::readlink((files + "/" + file).c_str(), target.data(), target.size());
            if (length < 0 || std::string_view(target.data(), static_cast<std::size_t>(length)) != wanted) return false;
            std::string name;
            std::getline(std::ifstream("/proc/" + pid + "/comm"), name);
            // It is printed, and a terminal obeys what is not text.
            std::erase_if(name, [](char c) { return c < ' ' || c > '~'; });
            holder = fmt::format("{} (pid {})", name.empty() ? "a process" : name, pid);
            return true;
        });
        return !holder.empty();
    });
    return holder;
}

}  // namespace

std::string holderOfPort(std::uint16_t port) {
    for (const char* table : {"/proc/net/tcp", "/proc/net/tcp6"}) {
        const std::optional<ListeningSocket> socket = listeningIn(table, port);
        if (!socket) continue;
        const std::string holder = processWith(socket->inode);
        return holder.empty() ? fmt::format("a process of user {}", socket->user) : holder;
    }
    return {};
}

}  // namespace tessera
