(** Movements of some coordinates, each in units of its scale, as a first stage: x = selector u + what stays. *)
From Coq Require Import List ZArith Reals Lra Lia Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Distance.
Import ListNotations.

Fixpoint count (moves : list bool) : nat :=
  match moves with [] => O | true :: m => S (count m) | false :: m => count m end.
(** A row per input, a column per coordinate that moves. *)
Fixpoint selector (moves : list bool) (scale : list dyadic) : matrixD :=
  match moves with
  | [] => []
  | true :: m => (hd one scale :: repeat zero (count m)) :: map (cons zero) (selector m (tl scale))
  | false :: m => repeat zero (count m) :: selector m (tl scale)
  end.

Open Scope R_scope.
Fixpoint movement (moves : list bool) (scale : list dyadic) (x : list R) : list R :=
  match moves, x with
  | true :: m, a :: x' => a / real (hd one scale) :: movement m (tl scale) x'
  | false :: m, _ :: x' => movement m (tl scale) x'
  | _, _ => []
  end.
Fixpoint staying (moves : list bool) (x : list R) : list R :=
  match moves, x with m :: moves', a :: x' => (if m then 0 else a) :: staying moves' x' | _, _ => [] end.

Lemma length_selector moves scale : length (selector moves scale) = length moves.
Proof. revert scale. induction moves as [ | [ | ] m IH]; intros; simpl; auto; now rewrite ?map_length, IH. Qed.
Lemma selector_columns moves scale : length (hd [] (selector moves scale)) = count moves.
Proof. destruct moves as [ | [ | ] m]; simpl; now rewrite ?repeat_length. Qed.
Lemma length_movement moves scale x : length x = length moves -> length (movement moves scale x) = count moves.
Proof.
  revert scale x. induction moves as [ | [ | ] m IH]; intros scale [|a x]; simpl; try discriminate; auto.
Qed.
Lemma length_staying moves x : length x = length moves -> length (staying moves x) = length moves.
Proof. revert x. induction moves as [|m moves IH]; intros [|a x]; simpl; try discriminate; auto. Qed.
Lemma agree_staying moves x y : agree moves x y -> staying moves x = staying moves y.
Proof.
  revert x y. induction moves as [|m moves IH]; intros [|a x] [|b y]; simpl; try tauto.
  intros [H G]. f_equal; auto. destruct H as [-> | ->]; auto.
Qed.

Definition positive_scale (scale : list dyadic) : bool := forallb is_positive scale.
Lemma positive_hd scale : positive_scale scale = true -> 0 < real (hd one scale) /\ positive_scale (tl scale) = true.
Proof.
  destruct scale as [|s scale]; simpl.
  - split; auto. unfold one, real. simpl. lra.
  - intros H. apply andb_prop in H. destruct H. split; auto. now apply real_positive.
Qed.
Lemma real_zeros n : map real (repeat zero n) = repeat 0 n.
Proof. induction n; simpl; auto. now rewrite IHn, real_zero. Qed.
Lemma selected moves scale x : positive_scale scale = true -> length x = length moves ->
  plusR (applyR (realm (selector moves scale)) (movement moves scale x)) (staying moves x) = x.
Proof.
  revert scale x. induction moves as [|m moves IH]; intros scale [|a x]; simpl; try discriminate; auto.
  intros Hs H. destruct (positive_hd _ Hs) as [P Q]. specialize (IH (tl scale) x Q ltac:(lia)). destruct m; simpl.
  - rewrite real_zeros, dot_zeros. f_equal; [field; lra|]. rewrite <- IH at 3. f_equal.
    unfold apply. rewrite !map_map. apply map_ext. intros r. simpl. rewrite real_zero. ring.
  - rewrite real_zeros, dot_zeros, IH. f_equal. ring.
Qed.
Lemma square_movement moves scale x y : agree moves x y -> positive_scale scale = true ->
  square (minus (movement moves scale x) (movement moves scale y)) = square_in scale (minus x y).
Proof.
  unfold square, minus. revert scale x y.
  induction moves as [|m moves IH]; intros scale [|a x] [|b y]; simpl; try tauto.
  intros [H G] Hs. destruct (positive_hd _ Hs) as [P Q]. rewrite <- (IH (tl scale) x y G Q). destruct m; simpl.
  - field. lra.
  - destruct H as [H | ->]; [discriminate|]. field. lra.
Qed.
