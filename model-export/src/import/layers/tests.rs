use super::*;

fn tensor(name: &str, shape: &[usize]) -> Tensor {
    let count = shape.iter().product::<usize>();
    Tensor {
        name: name.to_owned(),
        shape: shape.to_vec(),
        values: (0..count).map(|i| 0.1 * i as f32).collect(),
    }
}

/// The four tensors of a layer of torchbnn.
fn layer(name: &str, outputs: usize, inputs: usize) -> Vec<Tensor> {
    let own = |own: &str, shape: &[usize]| tensor(&format!("{name}.{own}"), shape);
    vec![
        own("weight_mu", &[outputs, inputs]),
        own("weight_log_sigma", &[outputs, inputs]),
        own("bias_mu", &[outputs]),
        own("bias_log_sigma", &[outputs]),
    ]
}

fn read(tensors: Vec<Tensor>, is_ordered: bool) -> Result<Vec<GaussianWeights>, LayersError> {
    let file = WeightFile {
        tensors,
        is_ordered,
    };
    networks(&file, Convention::Torchbnn, None, 12)
}

fn named(tensors: Vec<Tensor>, names: &[&[&str]]) -> Result<Vec<GaussianWeights>, LayersError> {
    let file = WeightFile {
        tensors,
        is_ordered: false,
    };
    let owned = |names: &&[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    let names: Vec<Vec<String>> = names.iter().map(owned).collect();
    networks(&file, Convention::Torchbnn, Some(&names), 12)
}

/// Two layers, which fit in one order only.
fn two(first: &str, second: &str) -> Vec<Tensor> {
    [layer(second, 3, 5), layer(first, 5, 12)].concat()
}

#[test]
fn weights_and_biases_come_layer_by_layer() {
    let tensors = [layer("0", 5, 12), layer("2", 3, 5)].concat();
    let networks = read(tensors.clone(), true).unwrap();
    let widths: Vec<usize> = networks[0].architecture.clone().into();
    assert_eq!(widths, [12, 5, 3]);
    let expected = |offset: usize| -> Vec<f32> {
        let of = |at: usize| tensors[at + offset].values.clone();
        [of(0), of(2), of(4), of(6)].concat()
    };
    assert_eq!(networks[0].means, expected(0));
    assert_eq!(networks[0].log_sigmas, expected(1));
    let reverse: Vec<Tensor> = tensors.iter().rev().cloned().collect();
    let renumbered = read(reverse, false).unwrap();
    assert_eq!(renumbered, networks);
}

#[test]
fn a_layer_without_biases_has_none() {
    let mut tensors = [layer("0", 5, 12), layer("2", 3, 5)].concat();
    tensors.drain(2..4);
    let network = &read(tensors, true).unwrap()[0];
    let shape = network.architecture.layers()[0];
    let biases = shape.bias(0)..shape.end();
    assert!(
        network.means[biases.clone()]
            .iter()
            .all(|mean| *mean == 0.0)
    );
    let none = |sigma: &f32| *sigma == f32::NEG_INFINITY;
    assert!(network.log_sigmas[biases].iter().all(none));
}

/// Numbers are numbers, not texts; other names need a recipe.
#[test]
fn what_has_no_order_is_given_one_or_refused() {
    for (first, second) in [
        ("2", "10"),
        ("net.9.x", "net.10.x"),
        ("10", "12"),
        ("a1", "a02"),
    ] {
        assert_eq!(
            read(two(first, second), false).unwrap().len(),
            1,
            "{first} {second}"
        );
    }
    for (first, second) in [
        ("in", "out"),
        ("a.1", "b.2"),
        ("1", "1x"),
        ("a1", "a01"),
        ("", "1"),
    ] {
        assert_eq!(
            read(two(first, second), false),
            Err(LayersError::NoOrder),
            "{first} {second}"
        );
        assert!(named(two(first, second), &[&[first, second]]).is_ok());
    }
}

#[test]
fn three_networks_are_named_and_others_refused() {
    let axis = |name| layer(name, 1, 12);
    let tensors = [axis("x"), axis("y"), axis("z")].concat();
    let found = named(tensors.clone(), &[&["x"], &["y"], &["z"]]).unwrap();
    assert_eq!(found.len(), 3);
    let refused = named(tensors[..8].to_vec(), &[&["x"], &["y"]]).unwrap_err();
    let expected = "2 networks of 1 outputs: it must be 1 of 3, or 3 of 1";
    assert_eq!(refused.to_string(), expected);
    let refused = named(tensors.clone(), &[&["x"], &["y"]]).unwrap_err();
    assert_eq!(refused, LayersError::NotOnce("z".into()));
    let refused = named(tensors.clone(), &[&["x"], &["y"], &["y"]]).unwrap_err();
    assert_eq!(refused, LayersError::NotOnce("y".into()));
    let refused = named(tensors, &[&["x"], &["y"], &["z", "w"]]).unwrap_err();
    assert_eq!(refused, LayersError::NotThere("w".into()));
    assert!(matches!(
        named(vec![], &[]),
        Err(LayersError::Outputs { .. })
    ));
    assert!(matches!(
        read(vec![], true),
        Err(LayersError::Architecture { .. })
    ));
}

#[test]
fn faults_name_tensor_and_layer() {
    let refused = |change: &dyn Fn(&mut Vec<Tensor>)| {
        let mut tensors = [layer("0", 5, 12), layer("2", 3, 5)].concat();
        change(&mut tensors);
        read(tensors, true).unwrap_err().to_string()
    };
    assert_eq!(
        refused(&|tensors| tensors.push(tensor("1.weight", &[5]))),
        "tensor \"1.weight\" is of no Bayesian dense layer of this layout"
    );
    assert_eq!(
        refused(&|tensors| tensors.push(tensor("2.bias_mu", &[3]))),
        "tensor \"2.bias_mu\" is there twice"
    );
    assert_eq!(
        refused(&|tensors| drop(tensors.remove(5))),
        "layer \"2\" has no deviations of the weights"
    );
    assert_eq!(
        refused(&|tensors| drop(tensors.remove(2))),
        "layer \"0\" has no bias means"
    );
    assert_eq!(
        refused(&|tensors| tensors[1] = tensor("0.weight_log_sigma", &[5, 11])),
        "tensor \"0.weight_log_sigma\" has the shape [5, 11], its layer needs [5, 12]"
    );
    assert_eq!(
        refused(&|tensors| tensors[0] = tensor("0.weight_mu", &[5, 12, 3])),
        "tensor \"0.weight_mu\" has the shape [5, 12, 3], and a dense layer's is [outputs, inputs]"
    );
    assert_eq!(
        refused(&|tensors| tensors[7].values[1] = f32::NAN),
        "tensor \"2.bias_log_sigma\" holds a number that is not finite"
    );
    assert_eq!(
        refused(&|tensors| *tensors = [layer("0", 65, 12), layer("2", 3, 65)].concat()),
        "the network of layer \"0\": width 65 is not within 1 to 64"
    );
    assert_eq!(
        refused(&|tensors| *tensors = layer("0", 3, 13)),
        "layer \"0\" has 13 inputs, what comes before it 12 outputs"
    );
    assert_eq!(
        refused(&|tensors| *tensors = layer("0", 2, 12)),
        "1 networks of 2 outputs: it must be 1 of 3, or 3 of 1"
    );
}

#[test]
fn what_layers_keep_for_themselves_does_not_count() {
    let mut tensors = [layer("0", 5, 12), layer("2", 3, 5)].concat();
    let without = read(tensors.clone(), true).unwrap();
    tensors.push(tensor("0.weight_eps", &[5, 12]));
    assert_eq!(read(tensors, true).unwrap(), without);
}
