#include "server/sim/journal/JournalDisk.h"

namespace tessera {

int JournalDisk::remembered(int error) {
    if (error != 0) failed_ = error;
    return error;
}

int JournalDisk::sync(int file) {
    const int failed = failed_;
    return failed != 0 ? failed : remembered(calls_->sync(file));
}

int JournalDisk::syncFolder(const std::string& path) {
    const int failed = failed_;
    return failed != 0 ? failed : remembered(calls_->syncFolder(path));
}

}  // namespace tessera
