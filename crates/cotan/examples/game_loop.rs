//! A session in a struct that a game loop holds, on a thread of its own: a scheme and an updater of
//! one's own, goals sent in, shapes sent back.
//!
//! `cargo run -p cotan --example game_loop`

use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use cotan::prelude::*;

/// Edges count by their direction: stiff along x, soft across it.
struct Grain;

impl LaplacianScheme<f64> for Grain {
    fn weights(
        &self,
        surface: &Surface<'_, f64>,
        out: &mut HalfedgeMap<f64>,
    ) -> Result<(), SchemeError> {
        Cotangent::default().weights(surface, out)?;
        let (mesh, p) = (surface.mesh(), surface.positions());
        for h in mesh.halfedges() {
            let along = (p[mesh.target(h)] - p[mesh.origin(h)]).normalize().x;
            out[h] *= 0.3 + along * along;
        }
        Ok(())
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::Symmetric
    }
}

/// Details lose a tenth of their size.
struct Softer;

impl ScalarFieldUpdater<f64> for Softer {
    fn update(
        &mut self,
        state: &FlowState<'_, f64>,
        field: &mut VertexMap<f64>,
    ) -> Result<(), FlowError> {
        field
            .as_mut_slice()
            .copy_from_slice(state.rest().magnitudes().as_slice());
        field.values_mut().for_each(|size| *size *= 0.9);
        Ok(())
    }
}

/// What the game keeps of a creature.
struct Creature {
    session: Session<f64>,
    hand: HandleId,
}

impl Creature {
    fn live(
        mut self,
        goals: &Receiver<Point3<f64>>,
        shapes: &Sender<Positions<f64>>,
    ) -> Result<(), Error> {
        for goal in goals {
            self.session
                .move_handle(self.hand, &Motion::To(vec![goal]))?;
            for _ in 0..10 {
                self.session.step()?;
            }
            if shapes.send(self.session.positions()).is_err() {
                break;
            }
        }
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let shape = cotan::shapes::bar::<f64>([4.0, 1.0, 1.0], [24, 6, 6]);
    let feet = shape.surface().vertices_where(|p| p.x < -1.99);
    let tip = shape.surface().vertices_where(|p| p.x > 1.99)[0];
    let mut handles = Handles::new().fix(feet);
    let hand = handles.push([tip], Motion::Stay, Hold::Hard);
    let flow = Flow::builder(&shape.mesh, &shape.positions)
        .scheme(Grain)
        .updater(Softer)
        .orientation(Limited::new());
    let creature = Creature {
        session: Session::from_flow(flow, &handles)?,
        hand,
    };

    let ((goal, goals), (shape_out, shapes)) = (channel(), channel());
    let thread = thread::spawn(move || creature.live(&goals, &shape_out));
    for frame in 1..=5 {
        let wanted = shape.positions[tip] + Vector3::y() * (0.2 * f64::from(frame));
        goal.send(wanted)?;
        let now = shapes.recv()?;
        println!("frame {frame}: the tip is at {:.2}", now[tip]);
        assert_eq!(now[tip], wanted);
    }
    drop(goal);
    thread.join().map_err(|_| "the creature died")??;
    Ok(())
}
