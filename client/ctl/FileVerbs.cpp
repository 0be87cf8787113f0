#include "client/ctl/FileVerbs.h"

#include "client/ctl/TextTable.h"

namespace tessera {

Expected<Answer> run(Application& application, const verb::Files& files) {
    Answer answer;
    nlohmann::ordered_json entries = nlohmann::ordered_json::array();
    TextTable table({"bytes", "loads", "path"});
    FolderWish wish{.folder = files.folder, .pageSize = kMostFolderEntries};
    do {
        const Expected<answer::FolderPage> page = application.files(wish);
        if (!page) return tl::unexpected(page.error());
        for (const FolderEntry& entry : page->entries) {
            const bool endsSo = entry.path.ends_with('/');
            table.add({entry.isFolder ? "" : std::to_string(entry.bytes), entry.loads ? "yes" : "",
                       withoutControls(entry.path) + (entry.isFolder && !endsSo ? "/" : "")});
            entries.push_back({{"name", entry.name},
                               {"path", entry.path},
                               {"is_folder", entry.isFolder},
                               {"bytes", entry.bytes},
                               {"loads", entry.loads}});
        }
        wish.after = page->next;
    } while (!wish.after.empty());
    answer.text = entries.empty() ? "nothing lies there\n" : table.text();
    answer.json = {{"entries", std::move(entries)}};
    return answer;
}

}  // namespace tessera
