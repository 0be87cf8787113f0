#include "common/base/JournalStream.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>

namespace tessera {

bool leadsToJournal(int file) {
    const char* said = std::getenv("JOURNAL_STREAM");
    struct stat info {};
    if (said == nullptr || ::fstat(file, &info) != 0) return false;
    return std::string_view(said) == std::to_string(info.st_dev) + ":" + std::to_string(info.st_ino);
}

std::string journalEntry(const JournalFields& fields) {
    std::string entry;
    for (const auto& [name, value] : fields) {
        entry += name;
        if (value.find('\n') == std::string::npos) {
            entry += '=';
        } else {
            entry += '\n';
            for (int shift = 0; shift < 64; shift += 8)
                entry += static_cast<char>(static_cast<std::uint64_t>(value.size()) >> shift & 0xff);
        }
        entry += value;
        entry += '\n';
    }
    return entry;
}

std::unique_ptr<JournalSocket> JournalSocket::connectTo(const std::string& path) {
    sockaddr_un address{};
    if (path.size() >= sizeof address.sun_path) return nullptr;
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, path.data(), path.size());
    FileHandle file(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    if (::connect(file.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return nullptr;
    return std::unique_ptr<JournalSocket>(new JournalSocket(std::move(file)));
}

bool JournalSocket::send(std::string_view entry) const {
    while (::send(file_.get(), entry.data(), entry.size(), MSG_NOSIGNAL) < 0)
        if (errno != EINTR) return false;
    return true;
}

}  // namespace tessera
