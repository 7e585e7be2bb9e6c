//! A panic ends a run as any other fault does: with the rig switched off in order.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::task::Poll;

use super::stop_reason::StopReason;

/// Makes a panic of the sequence a reason to switch off in order, as any other.
pub async fn survive(sequence: impl Future<Output = Result<(), StopReason>>) -> Result<(), StopReason> {
    let mut sequence = std::pin::pin!(sequence);
    std::future::poll_fn(|context| {
        // The rig is only switched off afterwards, from whatever state it is in.
        catch_unwind(AssertUnwindSafe(|| sequence.as_mut().poll(context))).unwrap_or_else(|panic| {
            let what = panic.downcast_ref::<&str>().map(ToString::to_string);
            let what = what.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
            Poll::Ready(Err(StopReason::Panic { what }))
        })
    })
    .await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_panic_is_a_halt_with_its_message() {
        let outcome = survive(async {
            tokio::task::yield_now().await;
            panic!("no such {}", "thing")
        })
        .await;
        assert!(matches!(outcome, Err(StopReason::Panic { what }) if what == "no such thing"));
        assert!(survive(async { Ok(()) }).await.is_ok());
        assert!(matches!(survive(async { Err(StopReason::Operator) }).await, Err(StopReason::Operator)));
    }
}
