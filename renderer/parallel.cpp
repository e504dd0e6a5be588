#include "renderer/parallel.h"

#include <atomic>
#include <condition_variable>
#include <list>
#include <mutex>
#include <vector>

namespace halflight {

namespace {

// One call of RunOnCores; lives as long as the call.
struct Job {
  size_t count;
  const std::function<void(size_t)>& task;
  std::atomic<size_t> next = 0;
  size_t helpers = 0;  // threads at work on it beside the caller; under the pool's mutex
  std::condition_variable alone{};  // no helper is left

  void Work() {
    for (size_t i = next++; i < count; i = next++) task(i);
  }
  [[nodiscard]] bool HasWork() const { return next < count; }
};

// A thread for each core but the caller's. They take the oldest job that has work left; a job waits
// only for tasks that some thread is at, so that jobs within jobs come to an end.
class CorePool {
 public:
  CorePool() {
    for (size_t i = 1; i < CoreCount(); ++i) threads_.emplace_back([this] { Help(); });
  }
  ~CorePool() {
    {
      const std::lock_guard lock(mutex_);
      closing_ = true;
    }
    work_.notify_all();
  }
  CorePool(const CorePool&) = delete;
  CorePool& operator=(const CorePool&) = delete;
  CorePool(CorePool&&) = delete;
  CorePool& operator=(CorePool&&) = delete;

  void Run(Job& job) {
    std::list<Job*> entry{&job};
    {
      const std::lock_guard lock(mutex_);
      jobs_.splice(jobs_.end(), entry);
    }
    if (job.count > 2) {
      work_.notify_all();
    } else {
      work_.notify_one();
    }
    job.Work();
    std::unique_lock lock(mutex_);
    jobs_.remove(&job);
    job.alone.wait(lock, [&] { return job.helpers == 0; });
  }

 private:
  void Help() {
    std::unique_lock lock(mutex_);
    while (true) {
      Job* job = nullptr;
      work_.wait(lock, [&] { return closing_ || (job = FirstWithWork()) != nullptr; });
      if (closing_) return;
      ++job->helpers;
      lock.unlock();
      job->Work();
      lock.lock();
      // Under the mutex: the job may be gone as soon as it is released.
      if (--job->helpers == 0) job->alone.notify_one();
    }
  }

  // Under the mutex.
  Job* FirstWithWork() {
    for (Job* job : jobs_) {
      if (job->HasWork()) return job;
    }
    return nullptr;
  }

  std::mutex mutex_;
  std::condition_variable work_;
  std::list<Job*> jobs_;
  bool closing_ = false;
  std::vector<std::jthread> threads_;  // last: they use all of the above
};

}  // namespace

void RunOnCores(size_t count, const std::function<void(size_t)>& task) {
  if (count <= 1 || CoreCount() == 1) {
    for (size_t i = 0; i < count; ++i) task(i);
    return;
  }
  static CorePool pool;
  Job job{count, task};
  pool.Run(job);
}

}  // namespace halflight
