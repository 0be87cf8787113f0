/// The lists of the last step, for as long as somebody holds one that has not been made.
#pragma once

#include <memory>

#include "server/collision/pipeline/ContactList.h"
#include "server/collision/pipeline/EventBook.h"

namespace tessera {

/// What they are made from stays where the last step left it until they are closed. Not thread-safe.
class StepLists {
public:
    StepLists() = default;
    ~StepLists() { close(); }
    StepLists(const StepLists&) = delete;
    StepLists& operator=(const StepLists&) = delete;

    struct Makers {
        std::function<std::vector<Contact>()> contacts;
        std::function<std::vector<PairEvent>()> events;
        std::function<std::vector<PairDistance>()> distances;
    };
    /// To a result of that step. What somebody holds is given again.
    void give(const ContactList::Page& contacts, const EventBook::Page& events, const Makers& makers,
              StepResult& result);
    /// Before what they are made from changes: those that somebody holds are made.
    void close();
    /// The same where that is so of contacts alone; whether anybody waits for them.
    [[nodiscard]] bool contactsHeld() const { return !contacts_.expired(); }
    void makeContacts() {
        if (const auto late = contacts_.lock()) late->makeNow();
    }
    /// Whoever holds one that is not made has an empty one from now on.
    void forget();

private:
    std::weak_ptr<LazyList<Contact>::LateItems> contacts_;
    std::weak_ptr<LazyList<PairEvent>::LateItems> events_;
    std::weak_ptr<LazyList<PairDistance>::LateItems> distances_;
};

}  // namespace tessera
