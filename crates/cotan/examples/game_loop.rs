//! A session in a struct owned by a game loop, on a separate thread, with a custom scheme and
//! updater. Goals are sent in, shapes are sent back.
//!
//! `cargo run -p cotan --example game_loop`

use std::sync::mpsc::channel;

use cotan::prelude::*;

/// Cotangent weights, halved across x: a grain along which the body is stiff.
struct Grain;

impl LaplacianScheme<f64> for Grain {
    fn weights(&self, s: &Surface<'_, f64>, out: &mut HalfedgeMap<f64>) -> Result<(), SchemeError> {
        Cotangent::default().weights(s, out)?;
        let (mesh, p) = (s.mesh(), s.positions());
        for h in mesh.halfedges() {
            let along = (p[mesh.target(h)] - p[mesh.origin(h)]).normalize().x;
            out[h] *= 0.5 + 0.5 * along * along;
        }
        Ok(())
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::Symmetric
    }
}

/// Reduces the details to 90 % of their original size.
struct Softer;

impl ScalarFieldUpdater<f64> for Softer {
    fn update(
        &mut self,
        state: &FlowState<'_, f64>,
        field: &mut VertexMap<f64>,
    ) -> Result<(), FlowError> {
        *field = state.rest().magnitudes().map(|size| 0.9 * size);
        Ok(())
    }
}

/// The data of a creature in the game.
struct Creature {
    session: Session<f64>,
    hand: HandleId,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let shape = cotan::shapes::bar::<f64>([4.0, 1.0, 1.0], [24, 6, 6]);
    let feet = shape.surface().vertices_where(|p| p.x < -1.99);
    let tip = shape.surface().vertices_where(|p| p.x > 1.99)[0];
    let mut handles = Handles::new().fix(feet);
    let hand = handles.push([tip], Motion::Stay, Hold::Hard);
    let flow = Flow::builder(shape.connectivity(), shape.positions()).scheme(Grain);
    let flow = flow.updater(Softer).orientation(Limited::new());
    let session = Session::from_flow(flow, &handles)?;
    let mut creature = Creature { session, hand };

    let ((goal, goals), (out, shapes)) = (channel(), channel());
    let life = std::thread::spawn(move || {
        for goal in goals {
            let Creature { session, hand } = &mut creature;
            session.move_handle(*hand, &Motion::To(vec![goal]))?;
            (0..10).try_for_each(|_| session.step().map(drop))?;
            out.send(session.positions()).ok();
        }
        Ok::<_, Error>(())
    });
    for frame in 1..=5 {
        goal.send(shape.positions()[tip] + Vector3::y() * (0.2 * f64::from(frame)))?;
        println!("frame {frame}: the tip is at {:.2}", shapes.recv()?[tip]);
    }
    drop(goal);
    Ok(life.join().map_err(|_| "the creature died")??)
}
