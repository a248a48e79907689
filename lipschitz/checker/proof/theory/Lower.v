(** Lower bounds: the slope between two points, by exact evaluation. *)
From Coq Require Import List ZArith Reals Lra Lia Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning.
Import ListNotations.

Definition reluD (x : dyadic) : dyadic := if is_nonnegative x then x else zero.

Definition affineD (m : matrixD) b x := plus add (apply zero add mul m x) b.
Fixpoint networkD (hidden : list layerD) (last : layerD) (x : list dyadic) : list dyadic :=
  match hidden with
  | [] => affineD (fst last) (snd last) x
  | (m, b) :: hidden' => networkD hidden' last (map reluD (affineD m b x))
  end.
Definition minusD u v := plus add u (scale mul (-1, 0)%Z v).
Definition squareD u := dot zero add mul u u.
Definition check_lower hidden last lower x x' : bool :=
  is_nonnegative lower &&
  is_nonnegative (add (squareD (minusD (networkD hidden last x) (networkD hidden last x')))
                      (neg (mul (mul lower lower) (squareD (minusD x x'))))).

Open Scope R_scope.

Lemma real_relu x : real (reluD x) = relu (real x).
Proof.
  unfold reluD, relu. destruct (is_nonnegative x) eqn:E.
  - apply real_nonnegative in E. now rewrite Rmax_right.
  - assert (is_nonnegative (neg x) = true) as N by (unfold is_nonnegative, neg in *; simpl; apply Z.leb_le;
      apply Z.leb_gt in E; lia).
    apply real_nonnegative in N. rewrite real_neg in N. rewrite Rmax_left by lra. apply real_zero.
Qed.
Lemma real_affine m b x : reals (affineD m b x) = affine (realm m) (reals b) (reals x).
Proof.
  unfold affineD, affine. now rewrite (f_plus add Rplus real real_add),
      (f_apply zero add mul 0 Rplus Rmult real real_zero real_add real_mul).
Qed.
Definition relu_layers (hidden : list layerD) := map (fun l => (map relu, real_layer l)) hidden.
Lemma real_network hidden last x :
  reals (networkD hidden last x) = network (relu_layers hidden) (real_layer last) (reals x).
Proof.
  revert x. induction hidden as [|[m b] hidden IH]; intros x; simpl; [apply real_affine|].
  rewrite IH, <- real_affine, !map_map. f_equal. apply map_ext. apply real_relu.
Qed.
Lemma real_square_minus u v : real (squareD (minusD u v)) = square (minus (reals u) (reals v)).
Proof.
  unfold squareD, minusD, square, minus.
  rewrite (f_dot zero add mul 0 Rplus Rmult real real_zero real_add real_mul), (f_plus add Rplus real real_add),
    (f_scale mul Rmult real real_mul).
  replace (real (-1, 0)%Z) with (-1) by (unfold real; simpl; ring). reflexivity.
Qed.
Theorem check_lower_sound hidden last lower x x' : check_lower hidden last lower x x' = true ->
  let f := network (relu_layers hidden) (real_layer last) in
  real lower * norm (minus (reals x) (reals x')) <= norm (minus (f (reals x)) (f (reals x'))).
Proof.
  unfold check_lower. intros H. set (f := network (relu_layers hidden) (real_layer last)). cbv zeta.
      apply andb_prop in H. destruct H as [Hl H]. apply real_nonnegative in Hl, H.
  rewrite real_add, real_neg, !real_mul, !real_square_minus, !real_network in H. fold f in H.
  unfold norm. rewrite <- (sqrt_square (real lower)) at 1 by auto. rewrite <- sqrt_mult_alt by nra.
  apply sqrt_le_1_alt. lra.
Qed.
