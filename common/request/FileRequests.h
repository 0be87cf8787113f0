/// What lies in the folders from which an application may load.
#pragma once

#include "common/request/EditRequests.h"

namespace tessera {

inline constexpr std::uint32_t kMostFolderEntries = 512;

/// Pages in the order of names, byte by byte.
struct FolderWish {
    std::string folder;
    std::string after;  ///< the name at which the page before has ended
    std::uint32_t pageSize = 256;

    static constexpr std::string_view kName = "FolderWish";
    static constexpr auto members() {
        return std::tuple(
            member<&FolderWish::folder>(1, "folder").said("empty: those that may be looked into"),
            member<&FolderWish::after>(2, "after").said("`next` of the page before; empty: the first"),
            member<&FolderWish::pageSize>(3, "page_size").between(1, kMostFolderEntries).said("entries told at most"));
    }
};

struct FolderEntry {
    std::string name;
    std::string path;  ///< as a load, or the next wish, names it
    bool isFolder = false;
    std::uint64_t bytes = 0;
    bool loads = false;  ///< its ending is one of a scene, a model or a volume

    static constexpr std::string_view kName = "FolderEntry";
    static constexpr auto members() {
        return std::tuple(
            member<&FolderEntry::name>(1, "name"), member<&FolderEntry::path>(2, "path").said("as a load names it"),
            member<&FolderEntry::isFolder>(3, "is_folder"), member<&FolderEntry::bytes>(4, "bytes").in("bytes"),
            member<&FolderEntry::loads>(5, "loads").said("by its ending it can be loaded"));
    }
};

namespace answer {

struct FolderPage {
    std::vector<FolderEntry> entries;
    std::string next;  ///< `FolderWish::after` of the next page; empty: this is the last

    static constexpr ToldInfo kInfo{.name = "FolderPage", .answer = 30, .help = "A page of what lies in a folder"};
    static constexpr auto members() {
        return std::tuple(member<&FolderPage::entries>(1, "entries").atMost(&ApplicationLimits::maxPageNodes),
                          member<&FolderPage::next>(2, "next").said("where it goes on; empty: this is the last"));
    }
};

}  // namespace answer

namespace request {

/// Ordinary files and folders; nothing hidden, and no link that leads out of what may be looked into.
struct GetFiles {
    FolderWish wish;

    using Answer = answer::FolderPage;
    static constexpr RequestInfo kInfo{.number = 40,
                                       .name = "GetFiles",
                                       .role = Role::kOperator,
                                       .help = "A page of what lies in a folder from which files may be loaded",
                                       .example = R"({"folder":"/srv/models","page_size":100})"};
    static constexpr auto members() { return std::tuple(spreadMember<&GetFiles::wish>(1)); }
};

using OfFiles = std::variant<GetFiles>;

}  // namespace request

}  // namespace tessera
